"""The rules of the maker's manuals for one servo, stated a second time: an oracle for its answers.

Tables are lists of (address, size, access, lowest, highest, initial value) from the control tables
of the e-manual; packets are put together byte by byte.
"""

AX = [
    (0, 2, "r", 0, 0, 12), (2, 1, "r", 0, 0, 24), (3, 1, "rw", 0, 253, 1), (4, 1, "rw", 0, 254, 1),
    (5, 1, "rw", 0, 254, 250), (6, 2, "rw", 0, 1023, 0), (8, 2, "rw", 0, 1023, 1023),
    (11, 1, "rw", 0, 150, 70), (12, 1, "rw", 50, 250, 60), (13, 1, "rw", 50, 250, 140),
    (14, 2, "rw", 0, 1023, 1023), (16, 1, "rw", 0, 2, 2), (17, 1, "rw", 0, 127, 36),
    (18, 1, "rw", 0, 127, 36), (24, 1, "rw", 0, 1, 0), (25, 1, "rw", 0, 1, 0),
    (26, 1, "rw", 0, 255, 1), (27, 1, "rw", 0, 255, 1), (28, 1, "rw", 0, 254, 32),
    (29, 1, "rw", 0, 254, 32), (30, 2, "rw", 0, 1023, 512), (32, 2, "rw", 0, 2047, 0),
    (34, 2, "rw", 0, 1023, 1023), (36, 2, "r", 0, 0, 512), (38, 2, "r", 0, 0, 0),
    (40, 2, "r", 0, 0, 0), (42, 1, "r", 0, 0, 120), (43, 1, "r", 0, 0, 25), (44, 1, "r", 0, 0, 0),
    (46, 1, "r", 0, 0, 0), (47, 1, "rw", 0, 1, 0), (48, 2, "rw", 32, 1023, 32),
]  # fmt: skip
X = [
    (0, 2, "r", 0, 0, 1060), (2, 4, "r", 0, 0, 0), (6, 1, "r", 0, 0, 45), (7, 1, "rw", 0, 252, 1),
    (8, 1, "rw", 0, 7, 3), (9, 1, "rw", 0, 254, 250), (10, 1, "rw", 0, 13, 0),
    (11, 1, "rw", 0, 16, 3), (12, 1, "rw", 0, 255, 255), (13, 1, "rw", 1, 2, 2),
    (20, 4, "rw", -1044479, 1044479, 0), (24, 4, "rw", 0, 1023, 10), (31, 1, "rw", 0, 100, 72),
    (32, 2, "rw", 60, 140, 140), (34, 2, "rw", 60, 140, 60), (36, 2, "rw", 0, 885, 885),
    (44, 4, "rw", 0, 1023, 265), (48, 4, "rw", 0, 4095, 4095), (52, 4, "rw", 0, 4095, 0),
    (60, 1, "rw", 0, 3, 0), (63, 1, "rw", 0, 255, 52), (64, 1, "rw", 0, 1, 0),
    (65, 1, "rw", 0, 1, 0), (68, 1, "rw", 0, 2, 2), (69, 1, "r", 0, 0, 0), (70, 1, "r", 0, 0, 0),
    (76, 2, "rw", 0, 16383, 1000), (78, 2, "rw", 0, 16383, 100), (80, 2, "rw", 0, 16383, 4000),
    (82, 2, "rw", 0, 16383, 0), (84, 2, "rw", 0, 16383, 640), (88, 2, "rw", 0, 16383, 0),
    (90, 2, "rw", 0, 16383, 0), (98, 1, "rw", 0, 127, 0), (100, 2, "rw", -885, 885, 885),
    (104, 4, "rw", -1023, 1023, 0), (108, 4, "rw", 0, 32767, 0), (112, 4, "rw", 0, 32767, 0),
    (116, 4, "rw", -1048575, 1048575, 2048), (120, 2, "r", 0, 0, 0), (122, 1, "r", 0, 0, 0),
    (123, 1, "r", 0, 0, 0), (124, 2, "r", 0, 0, 0), (126, 2, "r", 0, 0, 0), (128, 4, "r", 0, 0, 0),
    (132, 4, "r", 0, 0, 2048), (136, 4, "r", 0, 0, 0), (140, 4, "r", 0, 0, 0),
    (144, 2, "r", 0, 0, 120), (146, 1, "r", 0, 0, 25), (147, 1, "r", 0, 0, 0),
]  # fmt: skip

BOUNDS = {100: (36, 36), 104: (44, 44), 116: (52, 48)}
"""Limits of the X series by address; one register bounds the amount in both directions."""


def crc(data):
    """CRC-16 of the manual bit by bit: polynomial x^16 + x^15 + x^2 + 1, most significant first."""
    value = 0
    for byte in data:
        for bit in range(7, -1, -1):
            top = value >> 15 ^ (byte >> bit & 1)
            value = (value << 1 & 0xFFFF) ^ (0x8005 if top else 0)
    return value


def packet(protocol, id_, kind, parameters):
    if protocol == 1:
        body = [id_, len(parameters) + 2, kind, *parameters]
        return bytes([255, 255, *body, 255 - sum(body) % 256])
    body = []
    for byte in [kind, *parameters]:
        body.append(byte)
        if body[-3:] == [255, 255, 253]:
            body.append(253)
    size = len(body) + 2
    head = bytes([255, 255, 253, 0, id_, size % 256, size // 256, *body])
    return head + bytes([crc(head) % 256, crc(head) // 256])


class Manual:
    """A servo at rest in its middle at 12 V and 25 °C, as the manual describes it."""

    def __init__(self, protocol, id_):
        self.protocol = protocol
        self.rows = {row[0]: row for row in (AX if protocol == 1 else X)}
        self.values = {row[0]: row[5] for row in self.rows.values()}
        self.id_at, self.level_at, self.ram = (3, 16, 24) if protocol == 1 else (7, 68, 64)
        self.enable_at, self.size = (24, 50) if protocol == 1 else (64, 148)
        self.values[self.id_at] = id_

    @property
    def id(self):
        return self.values[self.id_at]

    def moving(self):
        """Whether the motor is on, and the goal is more than 0.03 rad away: 6 or 20 steps."""
        if self.protocol == 1:
            return self.values[24] == 1 and abs(self.values[30] - 512) >= 6
        is_on = self.values[64] == 1 and self.values[36] != 0 and self.values[100] != 0
        return is_on and abs(self.values[116] - 2048) >= 20

    def memory(self):
        self.values[46 if self.protocol == 1 else 122] = int(self.moving())
        table = bytearray(self.size)
        for address, value in self.values.items():
            size = self.rows[address][1]
            table[address : address + size] = (value % 256**size).to_bytes(size, "little")
        return table

    def start(self):
        """Power-on: RAM begins anew."""
        for address, row in self.rows.items():
            if address >= self.ram:
                self.values[address] = row[5]
        if self.protocol == 1:
            self.values[34] = self.values[14]
        else:
            self.values[100] = self.values[36]

    def hardware(self):
        """Bits of voltage and overheating, of protocol 1.0."""
        low, high, hottest = ((12, 13, 11), (34, 32, 31))[self.protocol - 1]
        voltage = not self.values[low] <= 120 <= self.values[high]
        return voltage | (25 >= self.values[hottest]) << 2

    def write_error(self, address, data):
        """Number of the error of a write, 0 for none; in 1.0 the bit."""
        range_, length, access, limit = (8, 8, 8, 2) if self.protocol == 1 else (4, 5, 7, 6)
        end, at = address + len(data), address
        parts = []
        while at < end:
            if at not in self.rows:
                return access
            size = self.rows[at][1]
            if at + size > end:
                return length
            parts.append((at, data[at - address : at - address + size]))
            at += size
        for at, raw in parts:
            _, size, kind, low, high, _ = self.rows[at]
            value = int.from_bytes(raw, "little", signed=low < 0)
            locked = self.values[47 if self.protocol == 1 else 64]
            if kind == "r" or (at < self.ram and locked):
                return access
            if self.protocol == 1 and at == 47 and locked and value == 0:
                return range_
            if self.protocol == 1 and at == 30 and not self.values[6] <= value <= self.values[8]:
                return limit
            if not low <= value <= high:
                return range_
            if self.protocol == 2 and at in BOUNDS:
                least, most = (self.values[b] for b in BOUNDS[at])
                least = -most if BOUNDS[at][0] == BOUNDS[at][1] else least
                if not least <= value <= most:
                    return limit
        return 0

    def write(self, address, data):
        error = self.write_error(address, data)
        if error:
            return error
        at = address
        while at < address + len(data):
            size, low = self.rows[at][1], self.rows[at][3]
            raw = data[at - address : at - address + size]
            self.values[at] = int.from_bytes(raw, "little", signed=low < 0)
            if self.protocol == 1 and at == 30:
                self.values[24] = 1
            at += size
        return 0

    def answer(self, error, data, level):
        """A status packet, or none at this status return level."""
        if self.values[self.level_at] < level:
            return b""
        if self.protocol == 1:
            return packet(1, self.id, error | self.hardware(), data)
        return packet(2, self.id, 0x55, [error, *data])

    def part(self, address, size):
        """Answer to the reading of a part of the table."""
        if size < 1 or address + size > self.size:
            return self.answer(8 if self.protocol == 1 else 7, b"", 1)
        return self.answer(0, self.memory()[address : address + size], 1)

    def request(self, id_, kind, parameters, intact=True):
        """Answer to an instruction for this id or for all."""
        everybody, old = id_ == 254, self.protocol == 1
        if not intact:
            return b"" if everybody else self.answer(16 if old else 3, b"", 2)
        width = 1 if old else 2
        error, data, level = 0, b"", 2
        address = int.from_bytes(parameters[:width], "little")
        rest = bytes(parameters[width:])
        undefined, short = (64, 8) if old else (2, 5)
        if kind == 1:
            level, data = 0, b"" if old else bytes([0x24, 0x04, 45])
        elif kind == 2:
            if len(parameters) == 2 * width and not everybody:
                return self.part(address, int.from_bytes(rest, "little"))
            level, error = 1, short
        elif kind == 3:
            error = self.write(address, rest) if rest else short
        elif kind == 8 and not old:
            self.start()
        else:
            error = undefined
        if everybody and (kind != 1 or old):
            return b""
        return self.answer(error, b"" if error else data, level)
