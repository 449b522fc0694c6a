"""The run-time type checker of the tests: whole numbers count as numbers, as in all of Python."""

from beartype import BeartypeConf, beartype

check = beartype(conf=BeartypeConf(is_pep484_tower=True))
