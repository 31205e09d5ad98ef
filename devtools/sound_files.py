"""Sound files of every kind that the lab reads, from which damaged ones are made.

`make_sound` runs the lab once in a room, for the kinds of files that only runs leave. Every other function is a maker or
returns one: called with a folder and the room, a maker writes sound files of a kind into the folder, with the files that
their reader needs beside them.
"""

import shutil
from collections.abc import Callable
from pathlib import Path

from devtools.commands import environment, lab

INSTANCES = {
    "la": "3 3\n0 3 1 2 2 5\n1 4 0 1 2 2\n2 6 1 3 0 2\n",
    "ta": "2 2\nTimes\n3 2\n4 1\nMachines\n1 2\n2 1\n",
    "mk.fjs": "2 3 1.5\n2 2 1 3 2 5 1 3 4\n1 1 2 7\n",
    "line.dzn": "Ninner = 1;\ntmin = [150];\ntmax = [200];\nf = [31, 30];\ne = [| 11, 0 | 19, 3 |];\n",
    "shop.json": '{"jobs": [{"tasks": [0]}],\n "resources": [{"type": "machine"}],\n "tasks": [{"job": 0}],\n'
    ' "modes": [{"task": 0, "resources": [0], "duration": 3, "demands": [0]}]}\n',
}
LAYOUT = "from,to,time\nLU,M1,6\nLU,M2,8\nM1,LU,12\nM1,M2,6\nM2,LU,10\nM2,M1,6\n"
JOBS = "set,job,operation,machine,time\n7,1,1,M1,8\n7,1,2,M2,16\n"
SCHEDULES = {
    "agvs.csv": "job,machine,agv,from,to,start,end\nA,,v1,load,saw,0,20\nA,saw,,,,20,50\nA,,v1,saw,out,60,80\n",
    "shop.json": '{"tasks": [{"mode": 0, "resources": [0], "start": 0, "end": 3},\n'
    ' {"mode": 1, "resources": [1, 0], "start": 3, "end": 5}]}\n',
}
FAULTS = """
[[faults]]
what = "part moved"
part = "slice 1"
at_s = 20.0
by_m = [0.03, 0.0]

[[faults]]
what = "machine slow"
station = "toaster"
share = 1.5
"""
GRID = "S...#\n.##..\n....G\n"
MADE_BY_HAND = ("toast", "breakfast", "sorting", "toast-window", "two-toasters", "toast-case-1", "fms-arm")

Maker = Callable[[Path, Path], object]  # (folder, room)


def make_sound(room: Path) -> None:
    """Run the commands of the lab that leave files in a room. Raises AssertionError if one fails."""
    env = environment(room)
    answers = "1\n" * 400

    def made(*words: str, stdin: str = "", codes: tuple[int, ...] = (0,)) -> None:
        ended = lab(*words, cwd=room, env=env, stdin=stdin, timeout_s=600)
        assert ended.code in codes, f"lab {' '.join(words)}: exit {ended.code}: {ended.stderr[-500:]}"

    made("teach", "world-1", "--advisor", "terminal", "--plain", "--gate", "always", "--episodes", "3",
         "--out", "lesson", "--save", "mine",
         stdin="r\nr\nb\nu\n" * 300, codes=(0, 1))  # fmt: skip
    made("sequence", "toast", "--method", "srl", "--episodes", "20", "--advisor", "terminal", "--gate", "always", "--plain",
         stdin=answers + "quit\n", codes=(0, 1, 130))  # fmt: skip
    made("see", "--make", "2", "--out", "pictures")
    mats = (f"pictures/mat-{number}.png" for number in (1, 2, 3))
    made("see", *mats, "--calibrate", "--task", "toast", "--out", "lens.json")
    made("toolbox", "export", "mine", "--out", "mine.zip")
    made("study", "compare", "world-1", "--sessions", "2", "--advisor", "expert", "--out", "compared")
    made("run", "toast", "--toasts", "1", "--out", "run")
    lines = (room / "run" / "run.jsonl").read_text().splitlines(keepends=True)
    (room / "run" / "run.jsonl").write_text("".join(lines[:-1]))  # it looks like the journal of a stopped run


def tasks(*names: str) -> Maker:
    """The maker of files of tasks that ship, by name."""

    def made(folder: Path, room: Path) -> None:
        from lab.files import tasks_folder

        for name in names:
            shutil.copy(tasks_folder() / f"{name}.toml", folder)

    return made


def with_faults(folder: Path, room: Path) -> None:
    """Write the tasks that people wrote, and `faulty.toml`, which also has a table of faults."""
    tasks(*MADE_BY_HAND)(folder, room)
    text = (folder / "toast.toml").read_text()
    (folder / "faulty.toml").write_text(f"{text}\n{FAULTS}")


def texts(contents: dict[str, str]) -> Maker:
    """The maker of text files, file name -> content."""

    def made(folder: Path, room: Path) -> None:
        for name, text in contents.items():
            (folder / name).write_text(text)

    return made


def copied(*names: str) -> Maker:
    """The maker that copies the files and folders of the room that match the patterns."""

    def made(folder: Path, room: Path) -> None:
        for name in names:
            for path in sorted(room.glob(name)):
                if path.is_dir():
                    shutil.copytree(path, folder / path.name, ignore=shutil.ignore_patterns("*.html"))
                else:
                    shutil.copy(path, folder)

    return made


def instances(folder: Path, room: Path) -> None:
    """Write an instance in each format."""
    texts(INSTANCES)(folder, room)
    from lab_studies.comparisons.transport_instances import FOLDER

    for name in ("jobshoplab/ft06.yaml", "phillips-unger-tanks.csv", "phillips-unger-empty.csv"):
        shutil.copy(FOLDER / name, folder)


def _link(name: str, size: str = "0.04 0.04 0.04", at: str = "0 0 0", more: str = "") -> str:
    mass = '<inertial><mass value="1"/><inertia ixx=".01" ixy="0" ixz="0" iyy=".01" iyz="0" izz=".01"/></inertial>'
    solid = f'<collision><origin xyz="{at}"/><geometry><box size="{size}"/></geometry></collision>'
    return f'<link name="{name}">{mass}{more}{solid}{solid.replace("collision", "visual")}</link>\n'


def _joint(name: str, ends: tuple[str, str], xyz: str, axis: str, low: float, high: float) -> str:
    kind = "prismatic" if name in ("left", "right") else "revolute"
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{ends[0]}"/><child link="{ends[1]}"/><origin xyz="{xyz}"/>'
        f'<axis xyz="{axis}"/><limit lower="{low}" upper="{high}" velocity="2" effort="100"/></joint>\n'
    )


_MESH = '<visual><geometry><mesh filename="package://mine/part.stl" scale="0.01 0.01 0.01"/></geometry></visual>'
ARM = "".join([
    '<robot name="own"><material name="red"><color rgba="1 0 0 1"/></material>\n',
    _link("foot", more=_MESH), *(_link(f"l{n}") for n in range(1, 6)),
    '<link name="tool0"/><joint name="flange" type="fixed"><parent link="l5"/><child link="tool0"/></joint>\n',
    _link("finger_a", "0.02 0.01 0.06", "0 0.005 0.03"), _link("finger_b", "0.02 0.01 0.06", "0 -0.005 0.03"),
    _joint("j1", ("foot", "l1"), "0 0 0.3", "0 0 1", -2.9, 2.9), _joint("j2", ("l1", "l2"), "0 0 0.1", "0 1 0", -2, 2),
    _joint("j3", ("l2", "l3"), "0 0 0.4", "0 1 0", -0.1, 2.6), _joint("j4", ("l3", "l4"), "0 0 0.4", "0 1 0", -2, 2),
    _joint("j5", ("l4", "l5"), "0 0 0.1", "0 0 1", -3.1, 3.1),
    _joint("left", ("tool0", "finger_a"), "0 0 0.03", "0 1 0", 0, 0.03),
    _joint("right", ("tool0", "finger_b"), "0 0 0.03", "0 -1 0", 0, 0.03), "</robot>\n",
])  # fmt: skip


def own_arm(folder: Path, room: Path) -> None:
    """Write the URDF file of an arm with two fingers, and its mesh."""
    from trimesh.creation import box

    (folder / "own.urdf").write_text(ARM)
    box((1, 1, 1)).export(folder / "part.stl", file_type="stl")


def bodies(folder: Path, room: Path) -> None:
    """Copy the URDF files of stations, with their meshes."""
    from lab.files import assets_folder

    for path in assets_folder().iterdir():
        shutil.copy(path, folder)


def meshes(folder: Path, room: Path) -> None:
    """Write the mesh of a part in three formats."""
    from trimesh.creation import box

    mesh = box((0.02, 0.03, 0.04))
    for name, kind in (("text.stl", "stl_ascii"), ("binary.stl", "stl"), ("thing.obj", "obj")):
        mesh.export(folder / name, file_type=kind)


def exported(folder: Path, room: Path) -> None:
    """Write the room's run in every format of `lab export` that its arm has, and copy the run."""
    from lab.export import program_formats
    from lab.export.program import Options, Program

    program = Program.load(room / "run")
    for name, form in program_formats().items():
        try:
            files = form.write(program, Options("rectan", "2026/01/01 00:00"))
        except Exception:  # this arm does not have the format
            continue
        (folder / name).mkdir()
        for file, text in files.items():
            (folder / name / file).write_text(text)
    shutil.copytree(room / "run", folder / "run", ignore=shutil.ignore_patterns("*.html", "*.png"))


def hub(folder: Path, room: Path) -> None:
    """Write the room's policy as a folder for the Hub."""
    from lab.toolbox.hub_folder import hub_files
    from lab.toolbox.registry import Toolbox

    for name, content in hub_files(Toolbox(room / "toolbox").load(room / "toolbox" / "mine.safetensors")).items():
        (folder / name).write_bytes(content)


def many_policies(folder: Path, room: Path) -> None:
    """Fill a toolbox with so many policies that it has an index."""
    from dataclasses import replace

    from lab.toolbox.registry import Toolbox

    box = Toolbox(folder / "toolbox")
    mine = Toolbox(room / "toolbox").load(room / "toolbox" / "mine.safetensors")
    for number in range(60):
        box.save(replace(mine, name=f"mine {number}"))
    assert box.list()


def carried(folder: Path, room: Path) -> None:
    """Write the carried-over policy that the lab brings along."""
    from lab.sequencing.methods.carried_over_policy import DEFAULT
    from lab.tasks.sequencing import write_policy

    write_policy(folder / "carried.json", DEFAULT)
