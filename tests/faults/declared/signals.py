"""Signals to commands and to their processes, at some moments."""

from collections.abc import Iterator
from signal import Signals

from tests.faults.declared.disk import LIMITED
from tests.faults.declared.words import STUDY
from tests.faults.fault import RESULTS, Fault, Sent, compare, written
from tests.small_scene import SCENE

INT, TERM, HUP = Signals.SIGINT, Signals.SIGTERM, Signals.SIGHUP
ENDS = {INT: 130, TERM: 143, HUP: 129}
SAID = "interrupted"

BEGUN, WRITTEN, FINISHED = "out/.fotismos-lock", "out/.fotismos", "out/a/view.json"
PREPARED = written({"a.xml": SCENE, "b.xml": SCENE, "s.toml": STUDY})


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
        for when in (2.0, BEGUN, "out/fig-8-5a/view.json"):
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
    for number in (kill, TERM, Signals.SIGSEGV, Signals.SIGBUS, Signals.SIGABRT, Signals.SIGUSR1):
        for when in (0.05, BEGUN):
            yield Fault(f"{number.name} to the worker at {when}", compare(), number.name, (1,),
                        PREPARED, sent=(Sent(number, when, "worker"),))  # fmt: skip
    for number in (INT, Signals.SIGPIPE, Signals.SIGCHLD, Signals.SIGWINCH):
        yield Fault(f"{number.name} to the worker", compare(), "", (0,), PREPARED, RESULTS,
                    sent=(Sent(number, BEGUN, "worker"),))  # fmt: skip
    stop = Sent(Signals.SIGSTOP, BEGUN, "worker")
    yield Fault("SIGSTOP to the worker", (*compare(), "--timeout", "20"), "20 s without", (1,),
                PREPARED, sent=(stop,))  # fmt: skip
    yield Fault("SIGSTOP to the worker, and Ctrl-C", compare(), SAID, (130,), PREPARED,
                sent=(stop, Sent(INT, 1.0)))  # fmt: skip
    yield Fault("SIGKILL to the worker of a batch", compare("a.xml", "b.xml"), "SIGKILL", (1,),
                PREPARED, leaves=("out/?/comparison.json", "out/index.html", "out/run.json"),
                sent=(Sent(kill, BEGUN, "worker"),))  # fmt: skip
    for command in ("cost", "fit", "study"):
        yield Fault(f"SIGKILL to the worker of {command}", LIMITED[command], "SIGKILL", (1,),
                    PREPARED, sent=(Sent(kill, BEGUN, "worker"),))  # fmt: skip


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
    # Before Python listens, the signal itself ends it, as a shell tells by the same code.
    is_early = isinstance(sent[0].when, float)
    is_twice = len(sent) > 1
    codes = (0, ENDS[number], ENDS[sent[-1].number], *((-number,) if is_early else ()))
    said = None if is_early or is_twice else SAID
    return Fault(name, words or compare("a.xml", "b.xml"), said, codes, PREPARED, sent=sent)
