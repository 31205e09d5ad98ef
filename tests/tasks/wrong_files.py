"""Wrong task files: what ships with a slip in it, and the one line that the lab says of it."""

from typing import NamedTuple

FLAT = "v 0 0 0\nv 0.03 0 0\nv 0.03 0.03 0\nv 0 0.03 0\nf 1 2 3\nf 1 3 4\nf 1 2 4\nf 2 3 4\n"
CORNERS = ["0 0 0", "1 0 0", "1 1 0", "0 1 0", "0 0 1", "1 0 1", "1 1 1", "0 1 1"]
FACES = ["1 3 2", "1 4 3", "5 6 7", "5 7 8", "1 2 6", "1 6 5", "2 3 7", "2 7 6", "3 4 8", "3 8 7", "4 1 5", "4 5 8"]
OPEN = "\n".join([f"v {one}" for one in CORNERS] + [f"f {one}" for one in FACES[2:]])
CUBE = "\n".join([f"v {one}" for one in CORNERS] + [f"f {one}" for one in FACES])
LARGE = "\n".join([f"v {one.replace('1', '80')}" for one in CORNERS] + [f"f {one}" for one in FACES])
EMPTY_URDF = (
    '<robot name="m"><link name="a"><inertial><mass value="1"/>'
    '<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link></robot>'
)


class Wrong(NamedTuple):
    """One wrong file: which that ships it is made of, each edit, a piece of the line that is named, and what is said of it.

    `at`: "" where the file itself is meant. files: what lies beside it, by name.
    """

    name: str
    base: str
    edits: tuple[tuple[str, str], ...]
    at: str
    said: str
    files: dict[str, str] = {}  # noqa: RUF012


def wrong(name: str, base: str, old: str, new: str, said: str = "", at: str | None = None, **more: object) -> Wrong:
    edits = ((old, new), *more.get("also", ()))  # type: ignore[misc]
    return Wrong(name, base, edits, new if at is None else at, said, more.get("files", {}))  # type: ignore[arg-type]


MESH = 'shape = "cylinder"\nsize_m = [0.034, 0.070]     # diameter and height'
BUTTER_AREA = 'by = "head"'

WRONG = [
    # ---- what is not TOML, not a field, not a type
    wrong("a bracket is missing", "breakfast", "[robot]\n", "[robot\n", at=""),
    wrong("a key twice", "breakfast", "grip_force_n = 25.0", "grip_force_n = 25.0\ngrip_force_n = 25.0", at=""),
    wrong("a kind of file that is none", "breakfast", 'name = "breakfast"', 'kind = "taks"\nname = "breakfast"', at='kind = "taks"'),
    wrong("an unknown field of the robot", "breakfast", "speed_m_s = 0.5 ", "sped_m_s = 0.5 "),
    wrong("an unknown field of a part", "breakfast", "mass_kg = 0.10", "mass = 0.10"),
    wrong("an unknown field of a grid", "breakfast", "height_m = 0.215", "heigth_m = 0.215", at="heigth_m"),
    wrong("an unknown field of a learner", "breakfast", "beta = 1.3, episodes = 200", "bta = 1.3, episodes = 200", at="bta"),
    wrong("an unknown table", "breakfast", "[workspace]", "[workspac]"),
    wrong("a word for a number", "breakfast", "capacity = 3", 'capacity = "3"'),
    wrong("a number for a name", "breakfast", 'name = "shelf"', "name = 7"),
    wrong("a name with a slash", "breakfast", 'name = "shelf"', 'name = "she/lf"'),
    wrong("a time of no number", "breakfast", "processing_s = 35.0", "processing_s = nan"),
    # ---- parts
    wrong("an unknown shape", "breakfast", 'shape = "cylinder"', 'shape = "cylindre"'),
    wrong("a size of two numbers", "breakfast", "size_m = [0.12, 0.015, 0.12]", "size_m = [0.12, 0.015]"),
    wrong("a size below zero", "breakfast", "size_m = [0.12, 0.015, 0.12]", "size_m = [0.12, -0.015, 0.12]"),
    wrong("a negative mass", "breakfast", "mass_kg = 0.10", "mass_kg = -0.10"),
    wrong("no mass", "breakfast", "mass_kg = 0.10\n", "", at='[[parts]]\nname = "cup"'),
    wrong("no part at all", "sorting", "count = 1", "count = 0", at="count = 0", also=(("count = 1", "count = 0"),) * 3),
    wrong("a part without routes", "fms-arm", 'routes = [["incoming", "mill-in", ', '# routes = [["incoming", "mill-in", ', at='name = "sign"'),
    wrong("two parts of one name", "breakfast", 'name = "cup" ', 'name = "slice" '),
    wrong("a part called as a station", "breakfast", 'name = "cup" ', 'name = "tray" '),
    wrong("a part called as its number", "breakfast", 'name = "shelf"', 'name = "slice 1"'),
    wrong("an unknown pallet", "fms-arm", 'pallet = "pallet"           #', 'pallet = "palet"           #'),
    wrong("a pallet with a route", "fms-arm", 'pallet = "pallet"           #', 'pallet = "sign"           #'),
    wrong("a pallet lifted off at a buffer", "fms-arm", '"lathe-1-in", {', '{ station = "lathe-1-in", pallet = true }, {'),
    wrong("a pallet lifted off that there is not", "breakfast", '"coffee_machine", "tray"', '{ station = "coffee_machine", pallet = true }, "tray"'),
    wrong("a rider wider than its pallet", "fms-arm", "size_m = [0.024, 0.050] ", "size_m = [0.038, 0.050] "),
    wrong("a rider too tall for the palm", "fms-arm", "size_m = [0.024, 0.050] ", "size_m = [0.024, 0.250] "),
    wrong("a part wider than the gripper", "breakfast", "size_m = [0.034, 0.070]", "size_m = [0.084, 0.070]"),
    wrong("a box wider than the gripper both ways", "breakfast", "size_m = [0.12, 0.015, 0.12]", "size_m = [0.12, 0.055, 0.12]"),
    wrong("a part too flat", "breakfast", "size_m = [0.034, 0.070]", "size_m = [0.034, 0.002]", also=(("grip = { yaw = 0.0, up_m = 0.045 }\n", ""),)),
    wrong("a grip above the part", "breakfast", "up_m = 0.045", "up_m = 0.145"),
    wrong("a part too tall for the palm", "breakfast", "up_m = 0.09", "up_m = 0.005"),
    wrong("a mesh that is not there", "breakfast", MESH, 'shape = "mesh"\nfile = "cup.obj"', at="file ="),
    wrong("a mesh out of the folder", "breakfast", MESH, 'shape = "mesh"\nfile = "../cup.obj"', at="file ="),
    wrong("a mesh of another kind", "breakfast", MESH, 'shape = "mesh"\nfile = "cup.step"', at="file ="),
    wrong("a mesh with a hole", "breakfast", MESH, 'shape = "mesh"\nfile = "cup.obj"\nscale = 0.03', at="file =", files={"cup.obj": OPEN}),
    wrong("a flat mesh", "breakfast", MESH, 'shape = "mesh"\nfile = "cup.obj"', at="file =", files={"cup.obj": FLAT}),
    wrong("a mesh in millimetres", "breakfast", MESH, 'shape = "mesh"\nfile = "cup.obj"', at="file =", files={"cup.obj": LARGE}),
    wrong("a mesh of words", "breakfast", MESH, 'shape = "mesh"\nfile = "cup.stl"', at="file =", files={"cup.stl": "a cup"}),
    wrong("a look that is not there", "breakfast", 'look = "slice.urdf"', 'look = "slize.urdf"'),
    # ---- stations
    wrong("one name twice", "breakfast", 'name = "shelf"', 'name = "plate"'),
    wrong("a station called robot", "breakfast", '"shelf"', '"robot"', at='name = "robot"', also=(('"shelf"', '"robot"'),)),
    wrong("a kind of station that is none", "breakfast", 'kind = "buffer"', 'kind = "bufer"'),
    wrong("out of reach", "breakfast", "pose = [0.0, 0.80, 0.0]", "pose = [0.0, 1.80, 0.0]"),
    wrong("too near", "breakfast", "pose = [0.42, 0.56, 0.0]", "pose = [0.1, 0.1, 0.0]"),
    wrong("stations overlap", "breakfast", "pose = [0.42, 0.56, 0.0]", "pose = [0.05, 0.80, 0.0]", at="pose = [0.0, 0.80, 0.0]"),
    wrong("machines' bodies overlap", "fms-arm", "pose = [0.7, 0.58, 0.0]", "pose = [0.7, 0.22, 0.0]"),
    wrong("spots not as many as capacity", "breakfast", "capacity = 3", "capacity = 4"),
    wrong("a capacity of none", "breakfast", "capacity = 3", "capacity = 0"),
    wrong("a capacity too small for the order", "breakfast", "capacity = 8", "capacity = 1"),
    wrong("a body that is not there", "breakfast", 'body = "toaster.urdf"', 'body = "taoster.urdf"'),
    wrong("a body out of the folder", "breakfast", 'body = "toaster.urdf"', 'body = "../toaster.urdf"'),
    wrong("a body by its full path", "breakfast", 'body = "toaster.urdf"', 'body = "/etc/passwd"'),
    wrong("a body of another kind", "breakfast", 'body = "toaster.urdf"', 'body = "mine.toml"'),
    wrong("a body that is no URDF", "breakfast", 'body = "toaster.urdf"', 'body = "my.urdf"', files={"my.urdf": "<html/>"}),
    wrong("a body that is no XML", "breakfast", 'body = "toaster.urdf"', 'body = "my.urdf"', files={"my.urdf": "toaster"}),
    wrong("a body with nothing solid", "breakfast", 'body = "toaster.urdf"', 'body = "my.urdf"', files={"my.urdf": EMPTY_URDF}),
    wrong("a body of a mesh of words", "breakfast", 'body = "toaster.urdf"', 'body = "my.obj"', files={"my.obj": "toaster"}),
    wrong("a body of a mesh in millimetres", "breakfast", 'body = "toaster.urdf"', 'body = "my.obj"', files={"my.obj": LARGE}),
    wrong("a storage whose body is not there", "breakfast", 'body = "slab"\nsize_m = [0.42, 0.36, 0.03]', 'body = "slap"', at='body = "slap"'),
    wrong("a storage with a body of words", "breakfast", 'body = "slab"\nsize_m = [0.42, 0.36, 0.03]', 'body = "my.stl"', at='body = "my.stl"', files={"my.stl": "tray"}),
    wrong("no floor", "breakfast", "floor_m = 0.015", "# floor_m = 0.015", at='body = "toaster.urdf"'),
    wrong("a box without a size", "breakfast", "size_m = [0.16, 0.16, 0.05]\n", "", at='[[stations]]\nname = "coffee_machine"'),
    wrong("a size for a file", "breakfast", "floor_m = 0.015", "floor_m = 0.015\nsize_m = [0.2, 0.2, 0.2]", at="size_m = [0.2, 0.2, 0.2]"),
    # ---- routes and times
    wrong("an unknown station in a route", "breakfast", 'station = "toaster",', 'station = "toster",', at="toster"),
    wrong("an unknown buffer in a route", "breakfast", 'buffer = "toaster_buffer"', 'buffer = "toast_buffer"', at="toast_buffer"),
    wrong("a route that begins at a machine", "breakfast", '["shelf", "coffee_machine", "tray"]', '["coffee_machine", "tray"]', at='["coffee_machine", "tray"]'),
    wrong("a route that ends at a machine", "breakfast", '["shelf", "coffee_machine", "tray"]', '["shelf", "coffee_machine"]', at='["shelf", "coffee_machine"]'),
    wrong("a route of one stage", "breakfast", '["shelf", "coffee_machine", "tray"]', '["shelf"]', at='["shelf"]'),
    wrong("a route without brackets", "breakfast", '[["shelf", "coffee_machine", "tray"]]', '["shelf", "tray"]', at='["shelf", "tray"]'),
    wrong("a station twice on a route", "breakfast", '["shelf", "coffee_machine", "tray"]', '["shelf", "coffee_machine", "coffee_machine", "tray"]', at='"coffee_machine", "coffee_machine"'),
    wrong("routes that begin apart", "two-toasters", '["plate", { station = "toaster-2"', '["finished_plate", { station = "toaster-2"', at='["finished_plate", {'),
    wrong("a buffer that is a machine", "breakfast", 'buffer = "toaster_buffer"', 'buffer = "coffee_machine"', at='buffer = "coffee_machine"'),
    wrong("a buffer as a start", "breakfast", '["shelf", "coffee_machine", "tray"]', '["toaster_buffer", "coffee_machine", "tray"]', at='["toaster_buffer"'),
    wrong("a machine without a time", "breakfast", "processing_s = 35.0 ", "# processing_s = 35.0 ", at='name = "coffee_machine"'),
    wrong("a machine with both times", "two-toasters", 'process = "butter" ', 'processing_s = 9.0\nprocess = "butter" ', at='processing_s = 9.0'),
    wrong("a time of its own in a learned process", "two-toasters", '{ station = "butter_applier", buffer = "butter_buffer" }', '{ station = "butter_applier", processing_s = 9.0 }', at='processing_s = 9.0 }'),
    wrong("a time at a storage", "breakfast", "capacity = 3", "capacity = 3\nprocessing_s = 5.0", at="processing_s = 5.0"),
    wrong("a time at a buffer in a route", "breakfast", '["shelf", "coffee_machine", "tray"]', '["shelf", "coffee_machine", { station = "tray", processing_s = 5.0 }]', at='["shelf", "coffee_machine", {'),
    # ---- processes
    wrong("an unknown process", "two-toasters", 'process = "butter" ', 'process = "buter" '),
    wrong("a process by the robot for a machine", "fms-arm", "processing_s = 600.0", 'process = "vacuum"', also=(("processing_s = 600, ", ""),)),
    wrong("a service by a head", "two-toasters", '{ station = "butter_applier", buffer = "butter_buffer" }', '{ station = "butter_applier", service = "butter" }', at='service = "butter" }'),
    wrong("a process without a head", "two-toasters", 'body = "applier.urdf"', 'body = "toaster.urdf"', at='process = "butter"'),
    wrong("a process on a box", "two-toasters", 'body = "applier.urdf"', 'body = "box"\nsize_m = [0.2, 0.2, 0.02]', at='process = "butter"'),
    wrong("a cover area out of reach", "fms-arm", "area_m = [0.10, 0.22]", "area_m = [1.10, 0.22]"),
    wrong("no area for the robot", "fms-arm", "area_m = [0.10, 0.22] ", "# area_m = [0.10, 0.22] ", at="[processes.vacuum]"),
    wrong("a grid of too many cells", "two-toasters", "grid = [3, 3]", "grid = [4, 4]"),
    wrong("a grid of five columns", "two-toasters", "grid = [3, 3]", "grid = [5, 2]"),
    # ---- camera and its grids
    wrong("a camera approach without a grid", "two-toasters", 'approach = "camera"\ngrid = { origin_m = [0.50, 0.05]', 'approach = "camera"\n# grid = { origin_m = [0.50, 0.05]', at='approach = "camera"'),
    wrong("a grid without a camera approach", "two-toasters", 'approach = "camera"\n', "", at="grid = {"),
    wrong("no camera", "sorting", 'finish = [0.80', 'approach = "camera"\ngrid = { origin_m = [0.5, -0.3], cell_m = 0.05, start_m = [0.575, -0.225], height_m = 0.3, marker_m = [0, 0, 0.1] }\nfinish = [0.80', at='approach = "camera"'),
    wrong("a grid whose start is blocked", "breakfast", "start_m = [0.575, -0.225]", "start_m = [0.725, -0.075]", at="grid = {"),
    wrong("a grid whose start is out of it", "breakfast", "start_m = [0.575, -0.225]", "start_m = [0.575, -0.425]", at="grid = {"),
    wrong("a grid that does not hold its station", "breakfast", "shape = [12, 12]", "shape = [6, 6]", at="grid = {"),
    wrong("a grid too low", "breakfast", "height_m = 0.215", "height_m = 0.1", at="grid = {"),
    wrong("obstacles of different heights in a grid", "breakfast", "position_m = [0.725, -0.075]\ncubes = 3", "position_m = [0.725, -0.075]\ncubes = 2", at='name = "cubes A"'),
    wrong("a camera that does not see its grid", "breakfast", "position_m = [0.84, 0.0, 2.4]", "position_m = [-0.84, 0.0, 2.4]", at='position_m = [-0.84'),
    # ---- obstacles
    wrong("an obstacle on a station", "breakfast", "position_m = [0.68, 0.45]", "position_m = [0.42, 0.56]"),
    wrong("an obstacle twice", "breakfast", 'name = "cubes B"', 'name = "cubes A"'),
    wrong("an obstacle blocks every way", "breakfast", 'name = "water tank"\nposition_m = [0.66, -0.69]\nsize_m = [0.16, 0.10, 0.26]', 'name = "water tank"\nposition_m = [0.27, -0.66]\nsize_m = [0.70, 0.02, 0.9]', at='name = "shelf"'),
    wrong("an obstacle of no size", "breakfast", "size_m = [0.16, 0.10, 0.26]", "size_m = [0.16, 0.0, 0.26]"),
    # ---- workspace and robot
    wrong("a workspace too low", "breakfast", "lower_m = [-0.48, -1.08, 0.24]", "lower_m = [-0.48, -1.08, 0.04]"),
    wrong("a workspace too small", "breakfast", "shape = [14, 18, 3]", "shape = [4, 4, 3]"),
    wrong("a workspace of no cells", "breakfast", "shape = [14, 18, 3]", "shape = [14, 18, 0]"),
    wrong("an unknown start", "breakfast", 'start = "toaster_buffer"', 'start = "toaster_bufer"'),
    wrong("an unknown arm", "breakfast", 'model = "up6"', 'model = "up7"'),
    wrong("an arm that is not there", "breakfast", 'model = "up6"', 'model = "my.urdf"\ntool_link = "t"\nfingers = ["f"]\ntip_m = 0.1', at='model = "my.urdf"'),
    wrong("an arm out of the folder", "breakfast", 'model = "up6"', 'model = "../my.urdf"\ntool_link = "t"\nfingers = ["f"]\ntip_m = 0.1', at='model = "../my.urdf"'),
    wrong("an arm that is no URDF", "breakfast", 'model = "up6"', 'model = "my.urdf"\ntool_link = "t"\nfingers = ["f"]\ntip_m = 0.1', at='model = "my.urdf"', files={"my.urdf": "<html/>"}),
    wrong("an arm without its tool", "breakfast", 'model = "up6"', 'model = "my.urdf"', at="[robot]"),
    wrong("an arm as fast as none", "breakfast", "speed_m_s = 0.5 ", "speed_m_s = 15 "),
    # ---- how it is learned
    wrong("an unknown sub-task", "breakfast", "[subtasks.insert]", "[subtasks.inset]"),
    wrong("an unknown learner", "breakfast", 'learner = "dyna-q"', 'learner = "dynaq"', at='"dynaq"'),
    wrong("an unknown gate", "breakfast", 'gate = "ccrl"', 'gate = "crcl"', at='"crcl"'),
    wrong("an unknown method", "breakfast", 'method = "srl-time"', 'method = "slr"'),
]
