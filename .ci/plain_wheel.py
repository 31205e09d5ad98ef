"""The wheel as users install it: built, installed into empty environments without and with each extra, and tried there.

`python3 .ci/plain_wheel.py`, from anywhere; whatever it makes is in a temporary folder. Uses nothing that is not in every Python.
Prints a line for each command, and ends with 1 when one did not do what it should.
"""

import json
import os
import subprocess
import sys
import time
from pathlib import Path
from runpy import run_path
from tempfile import TemporaryDirectory
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
PAGE_EXAMPLES = ROOT / "devtools" / "page_examples.py"
SMALL = "S..\n.#.\n..G"  # a grid world that is learned in a second
ALL_OK, WRONG_INPUT = 0, 2
CLUSTER = """
import subprocess, sys
from distributed import LocalCluster

if __name__ == "__main__":
    local = {"host": "127.0.0.1", "protocol": "tcp", "dashboard_address": None, "processes": False}
    with LocalCluster(n_workers=1, threads_per_worker=1, **local) as cluster:
        sys.exit(subprocess.run([sys.executable, *sys.argv[1:], "--dask", cluster.scheduler_address]).returncode)
"""

CLASS = json.dumps(
    {
        "format": "teaching-lab class 1",
        "code": "abcdef",
        "lessons": [{"subtask": "world-1", "advisors": ["web"]}],
        "seed": 0,
        "most": 30,
        "typed_names": False,
        "port": 0,
        "pupils": [{"number": 1, "name": "red owl", "key_hash": ""}],
    }
)


class Place:
    """An empty folder with a home, a toolbox and caches of its own, in which an environment's commands are run."""

    def __init__(self, folder: Path, python: Path, scripts: Path) -> None:
        self.work, self.python, self.lab = folder / "work", python, scripts / "lab"
        self.work.mkdir(parents=True)
        (self.work / "small.txt").write_text(SMALL)
        kept = {name: value for name, value in os.environ.items() if name in ("LANG", "LC_ALL", "TMPDIR", "TERM")}
        self.environment = {
            **kept,
            "PATH": os.pathsep.join([str(scripts), str(python.parent), "/usr/local/bin", "/usr/bin", "/bin"]),
            "HOME": str(folder / "home"),
            "LAB_TOOLBOX": str(folder / "toolbox"),
            "MINARI_DATASETS_PATH": str(folder / "minari"),
        }
        self.wrong: list[str] = []

    def run(self, *words: str, code: int = ALL_OK, said: str = "") -> Any:
        """What `lab WORDS --json` prints; None when it did not end with `code`, or its last line is without `said`."""
        found = self.called([str(self.lab), *words, "--json"], f"lab {' '.join(words)}", code, said)
        return None if found is None else json.loads(found)

    def called(self, words: list[str], shown: str, code: int = ALL_OK, said: str = "") -> str | None:
        """What a program for this environment's Python prints."""
        began = time.perf_counter()
        ran = subprocess.run(
            [str(self.python), *words], cwd=self.work, env=self.environment, stdin=subprocess.DEVNULL, **TEXT
        )
        right = ran.returncode == code and "Traceback" not in ran.stderr and "skipped:" not in ran.stderr
        right = right and said in (ran.stderr.splitlines() or [""])[-1]
        print(f"  {'ok' if right else 'NOT'}  {time.perf_counter() - began:5.1f} s  {shown}", flush=True)
        if not right:
            self.wrong.append(shown)
            print(f"exit {ran.returncode}, wanted {code} {said!r}\n{ran.stderr[-3000:]}", flush=True)
        return ran.stdout if right else None

    def hold(self, holds: bool, what: str) -> None:
        """Notes what does not hold."""
        print(f"  {'ok' if holds else 'NOT'}           {what}", flush=True)
        if not holds:
            self.wrong.append(what)


TEXT: dict[str, Any] = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True, "check": False}


def built(folder: Path) -> Path:
    """The wheel of this checkout."""
    pip(Path(sys.executable), "wheel", "--no-deps", "--wheel-dir", str(folder), str(ROOT))
    (wheel,) = folder.glob("*.whl")
    return wheel


def pip(python: Path, *words: str) -> None:
    subprocess.run([str(python), "-m", "pip", "--quiet", "--quiet", "--disable-pip-version-check", *words], check=True)


def environment(folder: Path, wanted: str, beside: Path | None = None) -> Path:
    """The interpreter of a new environment with what is wanted; `beside`: all that this one has is there already."""
    subprocess.run([sys.executable, "-m", "venv", str(folder)], check=True)
    python = folder / "bin" / "python"
    if beside is not None:
        (own,), (other,) = ((one.glob("lib/python*/site-packages")) for one in (folder, beside.parent.parent))
        (own / "plain.pth").write_text(f"{other}\n")
    pip(python, "install", wanted)
    return python


def toast(place: Place, *options: str) -> None:
    """Toast is made twice: the second run learns nothing and times nothing, and its prediction is right within 1 %."""
    cold = place.run("run", "toast", "--toasts", "1", *options)
    warm = place.run("run", "toast", "--toasts", "1", *options)
    if cold is None or warm is None:
        return
    if not options:
        place.hold(cold["timed_s"] > 0, f"the first run: moves were timed for {cold['timed_s']:.1f} s")
    name = " ".join(["the second run", *options])
    sources = {row["source"] for row in warm["skills"]}
    place.hold(sources == {"reused"}, f"{name}: all skills are reused: {sorted(sources)}")
    place.hold(warm["timed_s"] == 0.0, f"{name}: moves were timed for {warm['timed_s']} s")
    planned, measured = warm["predicted_makespan_s"], warm["measured_makespan_s"]
    right = measured is not None and abs(planned / measured - 1) < 0.01
    place.hold(right, f"{name}: predicted {planned:.1f} s, measured {measured} s")


def families(place: Place) -> None:
    """A command of each family that needs no extra."""
    place.run("teach", "small.txt", "--gate", "always", "--episodes", "5", "--out", "kept")
    place.run("replay", "kept")
    place.run("replay", "toast-run")
    place.run("export", "toast-run", "--format", "jbi")
    place.run("sequence", "toast", "--toasts", "2")
    place.run("operate", "toast", "--toasts", "1", "--out", "operated")
    place.run("view", "toast", "--out", "scene.html")
    place.run("see", "toast-run/overhead.png", "--task", "toast")
    place.run("new", "bakery", "--yes")
    place.run("task", "list")
    place.run("task", "show", "toast")
    place.run("task", "check", "bakery.toml")
    place.run("study", "list")
    place.run("study", "run", "table-9.2", "--sessions", "10")
    place.run("study", "run", "grips", "--sessions", "10")
    place.run("study", "compare", "small.txt", "--advisor", "none,expert", "--sessions", "2")
    if policies := place.run("toolbox", "list"):
        place.run("toolbox", "show", policies["policies"][0]["name"])
    place.run("toolbox", "verify")
    place.run("toolbox", "export", "--out", "skills.zip")
    place.run("toolbox", "import", "skills.zip", "--toolbox", "another")


def lessons(place: Place) -> None:
    """The pages whose commands are run, the five lessons among them: their commands and their Python, each in its own folder."""
    for folder in run_path(str(PAGE_EXAMPLES))["COMMANDS_RUN"]:
        for page in sorted((ROOT / "docs" / folder).glob("*.md")):
            page_run(place, page)


def page_run(place: Place, page: Path) -> None:
    """The examples of a page, in a folder of its own."""
    own = place.work / f"page-{page.stem}"
    own.mkdir()
    begin = f"import os\nos.chdir({str(own)!r})\n{PAGE_EXAMPLES.read_text(encoding='utf-8')}"
    place.called(["-c", begin, str(page)], f"the page {page.parent.name}/{page.stem}")


def refused(place: Place) -> None:
    """Without the extras, what needs one says which."""
    install = "is not installed: pip install '.[{}]'"
    place.run("tune", "small.txt", code=WRONG_INPUT, said=install.format("tune"))
    place.run("toolbox", "list", "--toolbox", "s3://lab/box", code=WRONG_INPUT, said=install.format("remote"))
    place.run("clone", "place", "--out", "cloned", code=WRONG_INPUT, said=install.format("recordings"))
    dask = ("study", "run", "table-9.2", "--dask", "127.0.0.1:9")
    place.run(*dask, code=WRONG_INPUT, said=install.format("dask"))
    place.run("replay", "kept", "--minari", "lab/kept-v0", code=WRONG_INPUT, said=install.format("data"))
    place.run("replay", "kept", "--tensorboard", "curves", code=WRONG_INPUT, said=install.format("data"))
    made = ("study", "export", "class", "--out", "tables")
    place.run(*made, "--parquet", code=WRONG_INPUT, said=install.format("people"))
    (place.work / "class").mkdir()
    (place.work / "class" / "class.json").write_text(CLASS)
    place.run(*made)
    arms_compared(place, code=WRONG_INPUT, said=install.format("people"))
    arms_compared(place, "--no-model")


def with_tune(place: Place) -> None:
    place.run("tune", "small.txt", "--trials", "2", "--sessions", "2")


def with_dask(place: Place) -> None:
    (place.work / "cluster.py").write_text(CLUSTER)
    study = [str(place.lab), "study", "run", "table-9.2", "--sessions", "10", "--json"]
    place.called(["cluster.py", *study], "lab study run table-9.2 --dask, on a cluster of one worker")


def with_remote(place: Place) -> None:
    """A folder as fsspec reaches it; S3 as far as it can be tried without a server: nothing listens on port 9."""
    box = ("--toolbox", (place.work / "box").as_uri())
    place.run("teach", "small.txt", "--gate", "always", "--episodes", "5", *box)
    place.run("toolbox", "verify", *box)
    place.environment |= {
        "AWS_ENDPOINT_URL": "http://127.0.0.1:9",
        "AWS_ACCESS_KEY_ID": "a",
        "AWS_SECRET_ACCESS_KEY": "b",
    }
    place.run("toolbox", "list", "--toolbox", "s3://lab/box", code=1, said="toolbox s3://lab/box cannot be ")


def with_data(place: Place) -> None:
    place.run("teach", "small.txt", "--gate", "always", "--episodes", "5", "--out", "kept")
    place.run("replay", "kept", "--minari", "lab/kept-v0", "--tensorboard", "curves")
    place.called(["-c", "import lab; print(lab.teach('small.txt', episodes=20).to_dataframe())"], "to_dataframe()")


def with_people(place: Place) -> None:
    (place.work / "class").mkdir()
    (place.work / "class" / "class.json").write_text(CLASS)
    place.run("study", "export", "class", "--out", "tables", "--parquet")
    arms_compared(place)


def with_recordings(place: Place) -> None:
    """A dataset with pictures is written and read, as the page about it does; a skill is cloned."""
    page_run(place, ROOT / "docs" / "recordings.md")
    few = ("--demonstrations", "2", "--rounds", "0", "--evaluated", "1", "--epochs", "5")
    place.run("clone", "place", *few, "--out", "cloned")


def arms_compared(place: Place, *options: str, **wanted: Any) -> None:
    """The arms of a study with four participants, in tables that are written here, are compared."""
    tables = place.work / "arms"
    tables.mkdir(exist_ok=True)
    (tables / "export.json").write_text('{"format": "teaching-lab export 1", "class": "arms"}')
    (tables / "dictionary.csv").write_text(
        "table,name,type,unit,meaning,allowed\nparticipants,lesson,integer,,,\nparticipants,seconds,number,s,,\n"
    )
    rows = [f"p{n},{arm},{1 + (arm == 'b')},{9 * n + n % 3 + (arm == 'b')}" for n in range(4) for arm in "ab"]
    (tables / "participants.csv").write_text("\n".join(["participant,arm,lesson,seconds", *rows, ""]))
    place.run("study", "people", "arms", "--out", "compared", *options, **wanted)


EXTRAS = {
    "dask": with_dask,
    "data": with_data,
    "people": with_people,
    "recordings": with_recordings,
    "remote": with_remote,
    "tune": with_tune,
}  # each but docs, test and dev


def main() -> int:
    began = time.perf_counter()
    with TemporaryDirectory(prefix="plain-wheel-") as temporary:
        folder = Path(temporary)
        wheel = built(folder / "wheel")
        plain = environment(folder / "plain", str(wheel))
        count = "from importlib.metadata import distributions; print(len([*distributions()]))"
        packages = subprocess.run([str(plain), "-c", count], capture_output=True, check=True, text=True).stdout.strip()
        print(f"{wheel.name}, {packages} packages with it, no extra ({time.perf_counter() - began:.0f} s)")
        place = Place(folder / "user", plain, plain.parent)
        toast(place)
        toast(place, "--override", "60")
        families(place)
        refused(place)
        lessons(place)
        wrong = place.wrong
        for extra, tried in EXTRAS.items():
            python = environment(folder / extra, f"{wheel}[{extra}]", beside=plain)
            print(f"the extra '{extra}' alone ({time.perf_counter() - began:.0f} s)", flush=True)
            place = Place(folder / f"user-{extra}", python, plain.parent)
            tried(place)
            wrong += place.wrong
    print(f"plain wheel: {len(wrong)} did not do what they should ({time.perf_counter() - began:.0f} s)")
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main())
