"""Participants of a study who are programs: they go through it by HTTP and websocket alone, as pages do."""

import asyncio
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed

from lab.classroom.class_place import Place
from lab.classroom.class_server import ClassServer
from lab.classroom.study import Study
from lab.teaching.subjects import subject_of
from tests.classroom.conftest import MAP, WITHIN_S, answer, asked, frames, join

Json = dict[str, Any]
PROTOCOL = Path(__file__).with_name("study.toml")
TLX = dict.fromkeys(("mental", "physical", "temporal", "performance", "effort", "frustration"), 35)
LAST: Json = {"like": 4, "hand": "left"}


def study_in(folder: Path, **changed: str) -> Study:
    """A new study of three arms in a world of six cells; changed: texts of the protocol, and what takes their place."""
    text = PROTOCOL.read_text()
    for before, after in changed.items():
        assert before in text
        text = text.replace(before, after)
    (folder / "small.txt").write_text(MAP)
    (folder / "study.toml").write_text(text)
    return Study.new(folder / "study.toml", folder / "study", subject_of)


def served(study: Study) -> ClassServer:
    """The study's server."""
    return ClassServer(study.roster, Place(), study=study)


@dataclass
class Scripted:
    """A participant with the page that the server named."""

    server: ClassServer
    page: str

    @classmethod
    def joined(cls, server: ClassServer) -> "Scripted":
        """Somebody who has typed the code and agreed to nothing yet."""
        return cls(server, join(server)["page"])

    @classmethod
    def agreed(cls, server: ClassServer) -> "Scripted":
        """A participant."""
        person = cls.joined(server)
        person.says(do="agree")
        return person

    def state(self) -> Json:
        """What the page shows."""
        status, said = asked(self.server, self.page.replace("/?", "/state?"))
        assert status == 200, said
        return dict(json.loads(said))

    def tries(self, **wish: Any) -> tuple[int, Json]:
        """The status and the answer to a wish."""
        status, said = asked(self.server, self.page.replace("/?", "/do?"), wish)
        return status, json.loads(said)

    def says(self, **wish: Any) -> Json:
        """What the page shows after a wish that is granted."""
        status, said = self.tries(**wish)
        assert status == 200, said
        return said

    def goes_on(self, shown: Json, **more: Any) -> Json:
        """The next step."""
        return self.says(do="go on", step=shown["step"], **more)

    def lesson(self, answers: bool = True) -> Json:
        """What the teaching page is told of the step when the lesson is over; answers: whether anything is answered."""
        return asyncio.run(asyncio.wait_for(self._lesson(answers), WITHIN_S))

    async def _lesson(self, answers: bool) -> Json:
        while True:
            try:
                async with connect(frames(self.server, self.page.replace("/step/", "/desk/")), proxy=None) as page:
                    return await self._taught(page, answers)
            except ConnectionClosed:  # "load again", as browsers do
                continue

    async def _taught(self, page: ClientConnection, answers: bool) -> Json:
        known: Json = {}
        answered = 0
        while True:
            news = json.loads(await page.recv())
            known |= news.get("seat", {})
            step = news.get("class", {}).get("study", {})
            if step.get("over"):
                return dict(step)
            question = known.get("question")
            if answers and question and known.get("you", {}).get("seat") and question["number"] != answered:
                answered = question["number"]
                if "+" in question["words"]:  # praise alone would have it run against the wall for ever
                    word = "+" if answered == 1 else "auto"
                    await page.send(json.dumps({"answer": {"question": answered, "word": word}}))
                else:
                    await answer(page, question, question["own"])

    def goes_through(self, until: str = "thanks") -> Json:
        """All steps, from the consent to a kind of step, or to the end; what the page shows then."""
        shown = self.state()
        while shown["kind"] not in (until, "thanks"):
            match shown["kind"]:
                case "consent":
                    shown = self.says(do="agree")
                case "lesson":
                    self.lesson(answers=self.arm() != "c")
                    shown = self.goes_on(shown)
                case "questionnaire":
                    answers = LAST if any(item["name"] == "hand" for item in shown["items"]) else TLX
                    shown = self.goes_on(shown, answers=answers)
                case _:
                    shown = self.goes_on(shown)
        return shown

    def kept(self) -> Json:
        """What is kept of the participant."""
        pupil = self.server.roster.of_key(self.page.partition("token=")[2])
        assert pupil is not None
        return dict(json.loads((self.server.roster.folder / pupil.folder / "participant.json").read_text()))

    def arm(self) -> str:
        """The arm of the current step, which participants are not told."""
        return str(self.kept()["steps"][-1]["arm"])
