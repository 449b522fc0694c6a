"""Trees that say the same in other words, and trees with one thing wrong."""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from phasmid.formats import TreeLink, tree_of
from phasmid.formats.meshes import primitive
from phasmid.formats.mjcf_out import mjcf_files
from phasmid.formats.urdf_out import urdf_files
from phasmid.robot import load_robot, preset_names
from phasmid.robot.inertial import Inertial
from phasmid.robot.leg import RATIOS
from support.general_robot import general_robot

ROBOTS = {name: load_robot(name) for name in preset_names()} | {"general": general_robot()}
ROBOTS["on balls"] = replace(ROBOTS["general"], name="on balls", foot_radius=0.0123)


def with_own_joints(robot):
    """The robot whose joints differ from leg to leg and joint to joint in all that is their own."""
    rng = np.random.default_rng(7)
    legs = tuple(
        replace(leg, **{name: rng.uniform(0.5, 2.0, 3) for name in RATIOS}) for leg in robot.legs
    )
    return replace(robot, legs=legs)


ROBOTS["own joints"] = with_own_joints(ROBOTS["phantomx-mk4"])


def write(files, folder):
    """Write files into a folder; return the first one's path."""
    for name, content in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    return folder / next(iter(files))


def files_of(robot, suffix):
    """A robot's files, the first of which is ``robot.urdf`` or ``robot.xml``."""
    if suffix == ".urdf":
        files = urdf_files(tree_of(robot), "robot")
    else:
        files = mjcf_files(robot, "robot")
    main = f"robot{suffix}"
    return {main: files.pop(main), **files}


def pose(R=None, p=(0, 0, 0)):
    X = np.eye(4)
    if R is not None:
        X[:3, :3] = R
    X[:3, 3] = p
    return X


def turn(axis, angle):
    return Rotation.from_rotvec(angle * np.asarray(axis) / np.linalg.norm(axis)).as_matrix()


def random_turn(rng):
    return Rotation.random(random_state=rng).as_matrix()


def renamed(tree, rng):
    """The tree under meaningless names, its links and joints in another order."""
    count = len(tree.links) + len(tree.joints)
    numbers = iter(rng.permutation(count))
    names = {name: f"x{next(numbers)}" for name in tree.links}
    links = {names[n]: replace(link, name=names[n]) for n, link in tree.links.items()}
    joints = [
        replace(j, name=f"x{next(numbers)}", parent=names[j.parent], child=names[j.child])
        for j in tree.joints
    ]
    order = list(links)
    rng.shuffle(order)
    rng.shuffle(joints)
    return replace(tree, links={name: links[name] for name in order}, joints=tuple(joints))


def reframed(tree, frames):
    """The tree with other frames in its links.

    Args:
        tree: The tree.
        frames: New frame of a link, by its name, in the old one, shape (4, 4); for a link on a
            hinge its origin must lie on the hinge's axis.
    """

    def old_to_new(name):
        return np.linalg.inv(frames.get(name, np.eye(4)))

    links = {}
    for name, link in tree.links.items():
        Y = old_to_new(name)
        inertial = link.inertial
        if inertial is not None:
            R = Y[:3, :3]
            com = R @ inertial.com + Y[:3, 3]
            inertial = Inertial(inertial.mass, com, R @ inertial.inertia @ R.T)
        parts = tuple(part.at(Y) for part in link.parts)
        links[name] = replace(link, inertial=inertial, parts=parts)
    joints = tuple(
        replace(
            j,
            X_parent_child=old_to_new(j.parent) @ j.X_parent_child @ frames.get(j.child, np.eye(4)),
            axis=old_to_new(j.child)[:3, :3] @ j.axis,
        )
        for j in tree.joints
    )
    return replace(tree, links=links, joints=joints)


def with_joints(tree, change):
    return replace(tree, joints=tuple(change(joint) for joint in tree.joints))


def with_joint(tree, name, **fields):
    return with_joints(tree, lambda j: replace(j, **fields) if j.name == name else j)


def with_link(tree, name, **fields):
    link = replace(tree.links.get(name, TreeLink(name)), **fields)
    return replace(tree, links={**tree.links, name: link})


def joined(tree, *joints, links=()):
    """The tree with more joints, and with their children unless they are given as links."""
    more = {j.child: TreeLink(j.child) for j in joints if j.child not in tree.links}
    more |= {link.name: link for link in links}
    return replace(tree, links={**tree.links, **more}, joints=(*tree.joints, *joints))


def block(low, high):
    shape = primitive("box", extents=np.subtract(high, low))
    return shape.at(pose(p=np.add(low, high) / 2))
