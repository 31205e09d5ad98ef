"""A class from its beginning to its end: where it is found, what is said meanwhile, and what is written at the end."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from ipaddress import ip_address
from pathlib import Path
from typing import Any

from lab.classroom.class_place import Place
from lab.classroom.class_report import write_report
from lab.classroom.class_server import STOP_S, ClassServer
from lab.errors import BadInput
from lab.files import is_file

LOOK_S = 0.5  # interval at which joined pupils and finished lessons are told
Json = dict[str, Any]


def place_of(
    address: str | None, names: Sequence[str] = (), certificate: Path | None = None, key: Path | None = None
) -> Place:
    """Where a class is found: on this computer alone, or at an address of it in a network, then over TLS.

    names: further host names under which pupils find that address. certificate, key: PEM files; None: made for the class.
    Raises BadInput for an address that is none of one computer, and for files that are missing or given alone.
    """
    if (certificate is None) != (key is None):
        raise BadInput("--certificate and --key belong together: give both, or none for a certificate made on the spot")
    if address is None:
        if certificate is not None or names:
            raise BadInput("--certificate, --key and --name are for a class in a network: add --lan ADDRESS")
        return Place()
    with suppress(ValueError):
        if ip_address(address).is_unspecified:
            raise BadInput(
                f"--lan {address}: that is every address of this computer: name the one in the class's network"
            )
    for file in (certificate, key):
        if file is not None and not is_file(file):
            raise BadInput(f"certificate: there is no file '{file}'")
    return Place(address, tuple(dict.fromkeys([*names, address])), True, certificate, key)


def begun_words(server: ClassServer) -> list[str]:
    """The lines for the teacher when the class begins."""
    lines = [
        f"{'pupils' if server.roster.study is None else 'participants'}: {server.join_url}",
        f"code: {server.roster.code}",
        f"your own page, for nobody else: {server.teacher_url}",
    ]
    return lines + [f"certificate, SHA-256: {server.fingerprint}"] * bool(server.fingerprint)


def attend(server: ClassServer, tell: Callable[[str], None]) -> None:
    """Wait until the teacher's page ends the class, and tell who has joined and whose lesson is over. Ctrl-C raises."""
    known = dict[int, Json]()
    while not server.ended.is_set():
        try:
            states = server.call(server.room.states)
        except TimeoutError:  # the computer is busy, or was asleep
            continue
        for number, now in states.items():
            before = known.get(number)
            if before is None:
                tell(f"{now['name']} ({number}) has a desk: lesson {now['lesson']}")
            elif (before["lesson"], before["state"]) != (now["lesson"], now["state"]) and now["state"] != "opening":
                why = f": {now['text']}" if now["text"] else ""
                tell(f"{now['name']} ({number}), lesson {now['lesson']}: {now['state']}{why}")
        known = states
        server.ended.wait(LOOK_S)


def closing(server: ClassServer) -> Json:
    """The document of the class, which ends now; its table, report and hand-outs are written into its folder. Raises BadInput.

    Nobody can withdraw or be removed while the files are written, because the server has stopped.
    """
    standing = server.call(server.room.standing, STOP_S)
    server.stop()
    document = write_report(server.roster, server.room.rows())
    for pupil in document["pupils"]:
        known = standing.get(pupil["number"], pupil)
        pupil |= {name: known[name] for name in ("lesson", "state", "text")}
    return document
