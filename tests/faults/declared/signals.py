"""Signals to commands and to their processes, at some moments."""

from collections.abc import Iterator
from signal import Signals

from tests.faults.declared.disk import LIMITED
from tests.faults.declared.scripts import GOOD
from tests.faults.declared.words import STUDY
from tests.faults.fault import RESULTS, Fault, Sent, compare, written
from tests.small_scene import SCENE

INT, TERM, HUP = Signals.SIGINT, Signals.SIGTERM, Signals.SIGHUP
ENDS = {INT: 130, TERM: 143, HUP: 129}
SAID = "interrupted"

BEGUN, WRITTEN, FINISHED = "out/.fotismos-lock", "out/.fotismos", "out/a/view.json"
UNDER_WAY = "started"
SLOW = "from pathlib import Path\nimport time\nPath('started').touch()\ntime.sleep(3)\n" + GOOD
PREPARED = written({"a.xml": SCENE, "b.xml": SCENE, "s.toml": STUDY, "slow.py": SLOW})


def faults() -> Iterator[Fault]:
    """Yield faults of signals."""
    for number in ENDS:
        for when in (0.05, 0.6, BEGUN, WRITTEN, FINISHED):
            yield _ended(f"{number.name} at {when}", number, Sent(number, when))
        yield _ended(f"{number.name} to the group", number, Sent(number, BEGUN, "group"))
        yield _ended(f"{number.name} twice", number, Sent(number, BEGUN), Sent(number, 0.02))
        yield _ended(f"{number.name} at once again", number, Sent(number, BEGUN), Sent(number))
    yield _ended("SIGINT, then SIGTERM", INT, Sent(INT, BEGUN), Sent(TERM, 0.05))
    for command, words in LIMITED.items():
        for number in (INT, TERM):
            when = 2.0 if command in ("plan", "check") else BEGUN
            yield _ended(f"{number.name} to {command}", number, Sent(number, when), words=words)
    report = ("report", "-o", "out", "--resolution", "8x8", "--spp", "4")
    for number in (INT, TERM):
        for when in (2.0, BEGUN, 15.0):
            yield _ended(f"{number.name} to report at {when}", number, Sent(number, when),
                         words=report)  # fmt: skip
    for words in (("scenes",), ("doctor",), ("completion", "bash")):
        yield _ended(f"SIGINT to {words[0]}", INT, Sent(INT, 0.15), words=words)
    yield from _killed()
    yield from _ignored()


def _killed() -> Iterator[Fault]:
    """Yield deaths that nobody hears of before, of the command and of the process that renders."""
    kill = Signals.SIGKILL
    for when in (0.05, 1.5, BEGUN, WRITTEN, FINISHED):
        yield Fault(f"SIGKILL at {when}", compare(), None, (0, -9), PREPARED, RESULTS,
                    sent=(Sent(kill, when),))  # fmt: skip
    yield Fault("SIGKILL, and once more", compare("a.xml", "b.xml"), None, (0,), PREPARED, RESULTS,
                shell='"$@" & sleep 9; kill -9 $!; wait; exec "$@"')  # fmt: skip
    for number in (TERM, Signals.SIGSEGV, Signals.SIGBUS, Signals.SIGABRT, Signals.SIGUSR1):
        # Before it has begun with a scene, another process takes its place.
        yield Fault(f"{number.name} to a worker that begins", compare(), number.name, (0, 1),
                    PREPARED, RESULTS, sent=(Sent(number, 0.05, "worker"),))  # fmt: skip
        yield Fault(f"{number.name} to the worker", compare("slow.py"), number.name, (1,),
                    PREPARED, sent=(Sent(number, UNDER_WAY, "worker"),))  # fmt: skip
    # What a killed process did is done by another one.
    for number in (kill, INT, Signals.SIGCHLD, Signals.SIGWINCH, Signals.SIGCONT):
        yield Fault(f"{number.name} to the worker", compare("slow.py"), "", (0,), PREPARED, RESULTS,
                    sent=(Sent(number, UNDER_WAY, "worker"),))  # fmt: skip
    stop = Sent(Signals.SIGSTOP, UNDER_WAY, "worker")
    yield Fault("SIGSTOP to the worker", (*compare("slow.py"), "--timeout", "20"), "20 s without",
                (1,), PREPARED, sent=(stop,))  # fmt: skip
    yield Fault("SIGSTOP to the worker, and Ctrl-C", compare("slow.py"), SAID, (130,), PREPARED,
                sent=(stop, Sent(INT, 1.0)))  # fmt: skip
    yield Fault("SIGKILL to a worker that begins", compare(), "", (0,), PREPARED, RESULTS,
                sent=(Sent(kill, 0.05, "worker"),))  # fmt: skip
    yield Fault("SIGKILL to the worker of a batch", compare("slow.py", "b.xml"), "", (0,),
                PREPARED, leaves=("out/b/comparison.json", "out/index.html", "out/run.json"),
                sent=(Sent(kill, UNDER_WAY, "worker"),))  # fmt: skip
    for command in ("plan", "cost", "fit"):
        words = tuple("slow.py" if word == "a.xml" else word for word in LIMITED[command])
        yield Fault(f"SIGKILL to the worker of {command}", words, "", (0,),
                    PREPARED, sent=(Sent(kill, UNDER_WAY, "worker"),))  # fmt: skip


def _ignored() -> Iterator[Fault]:
    """Yield signals that are not to end anything, and readers that have seen enough."""
    hang_up = Sent(HUP, BEGUN)
    yield Fault("SIGHUP under nohup", compare(), "", (0,), PREPARED, RESULTS,
                shell="trap '' HUP; exec \"$@\"", sent=(hang_up,))  # fmt: skip
    yield Fault("Ctrl-C in the background of a script", compare(), "", (0,), PREPARED, RESULTS,
                shell="trap '' INT; exec \"$@\"", sent=(Sent(INT, BEGUN),))  # fmt: skip
    for name, end in (("a reader of one line", "head -1"), ("a reader of nothing", "true"),
                      ("a reader that closes", "exec <&-")):  # fmt: skip
        for words in (("scenes",), ("plan", "a.xml"), ("--help",)):
            yield Fault(f"{name} of {words[0]}", words, None, (0,), PREPARED,
                        shell=f'"$@" | {{ {end}; }}')  # fmt: skip
    yield Fault("a reader of one line of a comparison", compare(), None, (0,), PREPARED, RESULTS,
                shell='"$@" | head -1')  # fmt: skip
    yield Fault("a reader of no message", compare("b.xm"), None, (0,), PREPARED,
                shell='"$@" 2>&1 | true')  # fmt: skip
    for number in (Signals.SIGCHLD, Signals.SIGWINCH, Signals.SIGCONT, Signals.SIGPIPE):
        yield Fault(f"{number.name} to the command", compare(), "", (0,), PREPARED, RESULTS,
                    sent=(Sent(number, BEGUN),))  # fmt: skip


def _ended(name: str, number: Signals, *sent: Sent, words: tuple[str, ...] = ()) -> Fault:
    """Return the fault of a command that is told to end, if it has not ended by itself."""
    # Before Python listens, and once it is done, the signal itself ends it: the same to a shell.
    is_early = isinstance(sent[0].when, float)
    is_twice = len(sent) > 1
    last = sent[-1].number
    codes = (0, ENDS[number], ENDS[last], *((-last,) if is_early or is_twice else ()))
    said = None if is_early or is_twice else SAID
    return Fault(name, words or compare("a.xml", "b.xml"), said, codes, PREPARED, sent=sent)
