"""LeRobot's rollout with a mentor: it pauses where the mentor would ask, so that you take over with LeRobot's own keys.

Run it in LeRobot's environment as you would run `lerobot-rollout`, with the file of a mentor that `lab mentor --keep` wrote:

    python lerobot_asking_rollout.py --mentor=mentor.safetensors --strategy.type=dagger --policy.path=... --robot.type=...

Written for LeRobot 0.6.1.
"""

import logging
from dataclasses import dataclass

import lerobot.scripts.lerobot_rollout  # noqa: F401  (registers robots, teleoperators and cameras)
from lerobot.configs import parser
from lerobot.rollout import DAggerStrategyConfig, RolloutConfig, build_rollout_context, create_strategy
from lerobot.utils.import_utils import register_third_party_plugins
from lerobot.utils.process import ProcessSignalHandler
from lerobot.utils.utils import init_logging, log_say

import lab


class AskingEngine:
    """An inference engine of LeRobot that calls `on_question` where its mentor would ask."""

    def __init__(self, engine, mentor, on_question):
        self.engine, self.mentor, self.on_question = engine, mentor, on_question
        self.asked, self.taught = False, None

    def __getattr__(self, name):  # start, stop, pause, resume and all else
        return getattr(self.engine, name)

    def get_action(self, obs_frame):
        action = self.engine.get_action(obs_frame)
        if action is not None:
            question = self.mentor(obs_frame, action)
            if question and not self.asked:  # once, until the doubt has passed or somebody took over
                self.on_question(question.why)
            self.asked = bool(question)
        return action

    def teach(self, observation, action):
        """Shows the mentor a step that a person gave."""
        self.mentor(observation, action, corrected=self.taught is not None)
        self.taught = observation, action

    def reset(self):  # LeRobot calls it at the begin, and after each pause
        if self.taught:
            self.mentor(*self.taught)  # the judge sees where the takeover has led
            self.asked, self.taught = False, None
        self.mentor.begin()
        self.engine.reset()


def ask_in(strategy, ctx, mentor, play_sounds):
    """Lets a mentor pause LeRobot's DAgger strategy, and see the steps that a person gives."""

    def on_question(why):
        log_say("The policy is in doubt", play_sounds)
        logging.warning("The mentor asks: %s", why)
        strategy._events.request_transition("pause_resume")

    def taught(given):
        action = processed(given)
        engine.teach(given[1], action)
        return action

    engine = ctx.policy.inference = AskingEngine(ctx.policy.inference, mentor, on_question)
    processed, ctx.processors.teleop_action_processor = ctx.processors.teleop_action_processor, taught


@dataclass
class AskingConfig(RolloutConfig):
    """The options of `lerobot-rollout`, and the mentor's file."""

    mentor: str = ""


@parser.wrap()
def rollout(cfg: AskingConfig):
    """Does what `lerobot-rollout` does, with a mentor."""
    init_logging()
    if not isinstance(cfg.strategy, DAggerStrategyConfig):
        raise SystemExit("--strategy.type: wanted dagger, the strategy in which a person takes over")
    try:
        mentor = lab.Mentor.load(cfg.mentor)
    except lab.LabError as error:
        raise SystemExit(f"--mentor: {error}") from error
    signals = ProcessSignalHandler(use_threads=True, display_pid=False)
    ctx = build_rollout_context(cfg, signals.shutdown_event)
    strategy = create_strategy(cfg.strategy)
    names = tuple(ctx.data.dataset_features["observation.state"]["names"]), tuple(ctx.data.ordered_action_keys)
    try:
        if names != (mentor.state_names, mentor.action_names):
            raise SystemExit(f"--mentor: it learned {mentor.state_names}, {mentor.action_names}; the robot has {names}")
        ask_in(strategy, ctx, mentor, cfg.play_sounds)
        strategy.setup(ctx)
        strategy.run(ctx)
    except KeyboardInterrupt:
        logging.info("Interrupted")
    finally:
        strategy.teardown(ctx)


if __name__ == "__main__":
    register_third_party_plugins()
    rollout()
