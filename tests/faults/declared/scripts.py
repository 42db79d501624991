"""Scenes in Python whose code does what no scene should."""

from collections.abc import Iterator

from tests.faults.fault import RESULTS, SMALL, UNPRIVILEGED, Fault, compare, then, written
from tests.small_scene import SCENE

GOOD = """
import mitsuba as mi

def scene():
    return {"type": "scene", "integrator": {"type": "direct"},
            "sensor": {"type": "perspective", "to_world": mi.ScalarTransform4f().look_at(
                [0, -5, 2], [0, 0, 0], [0, 0, 1])},
            "ball": {"type": "sphere", "bsdf": {"type": "diffuse"}},
            "lamp": {"type": "point", "position": [2, -3, 4], "intensity": 60.0}}
"""
HEAD = "import ctypes, os, signal, subprocess, sys, threading, time\nfrom pathlib import Path\n"
# A signal goes to the command alone, never to whatever is there in its place.
PARENT = """
parent = os.getppid()
assert b"FOTISMOS_MARK" in Path(f"/proc/{parent}/environ").read_bytes()
"""

DIES = {
    "os._exit(0)": "os._exit(0)",
    "os._exit(1)": "os._exit(1)",
    "os._exit(7)": "os._exit(7)",
    "os.abort()": "os.abort()",
    "SIGKILL to itself": "os.kill(os.getpid(), signal.SIGKILL)",
    "SIGSEGV to itself": "os.kill(os.getpid(), signal.SIGSEGV)",
    "SIGTERM to itself": "os.kill(os.getpid(), signal.SIGTERM)",
    "SIGHUP to itself": "os.kill(os.getpid(), signal.SIGHUP)",
    "SIGKILL to its group": "os.killpg(os.getpgid(0), signal.SIGKILL)",
    "a null pointer": "ctypes.string_at(0)",
    "a jump to nowhere": "ctypes.CFUNCTYPE(None)(1)()",
    "exec of another program": "os.execv('/bin/true', ['true'])",
    "exec of a program that prints": "os.execv('/bin/echo', ['echo', 'hello'])",
    "all files closed": "os.closerange(0, 1000)\ntime.sleep(1000)",
}
"""Ends of the process, which are one message."""

RAISES = {
    "an exception": "raise ValueError('of its own')",
    "an exception without words": "raise ValueError",
    "an exception that cannot be printed":
        "class Bad(Exception):\n  def __str__(self): raise ValueError('inner')\nraise Bad()",
    "an exception of several lines": "raise ValueError('one\\ntwo\\nthree')",
    "a BaseException": "class Own(BaseException): pass\nraise Own('of its own')",
    "KeyboardInterrupt": "raise KeyboardInterrupt",
    "GeneratorExit": "raise GeneratorExit",
    "sys.exit(0)": "sys.exit(0)",
    "sys.exit() with words": "sys.exit('done')",
    "exit()": "exit()",
    "endless recursion": "def f(): f()\nf()",
    "more memory than there is": "bytearray(2**62)",
    "a module that is not there": "import no_such_module",
    "a module with a syntax error": "sys.path.insert(0, '.')\nimport broken",
    "a division by zero": "1 / 0",
    "input()": "input()",
    "an assertion": "assert False",
    "StopIteration": "next(iter(()))",
    "an exception group": "raise ExceptionGroup('several', [ValueError('a'), ValueError('b')])",
    "a warning as an error": "import warnings\nwarnings.simplefilter('error')\nwarnings.warn('x')",
    "an unknown variant": "import mitsuba as mi\nmi.set_variant('no_such_variant')",
}  # fmt: skip

TYPES = {
    "no scene in it": "x = 1",
    "scene = None": "scene = None",
    "a list": "scene = [1]",
    "a number": "scene = 3",
    "a text": "scene = 'cornell-box'",
    "a class": "class scene: pass",
    "an empty dictionary": "scene = {}",
    "a dictionary without a type": "scene = {'a': 1}",
    "a shape": "scene = {'type': 'sphere'}",
    "a type that is none": "scene = {'type': 'scnee'}",
    "a type that is no text": "scene = {'type': 3}",
    "keys that are no text": "scene = {'type': 'scene', 1: 2}",
    "a dictionary that holds itself": "scene = {'type': 'scene'}\nscene['me'] = scene",
    "a function with an argument": "def scene(x): return {}",
    "a generator": "def scene():\n  yield {}",
    "a coroutine": "async def scene(): return {}",
    "an object inside": "scene = {'type': 'scene', 'x': object()}",
    "a function inside": "scene = {'type': 'scene', 'x': lambda: 1}",
    "a scene that is loaded": "import mitsuba as mi\nscene = mi.load_dict({'type': 'scene'})",
    "a dictionary in a million levels":
        "scene = {'type': 'scene'}\nfor _ in range(10**6): scene = {'type': 'scene', 'x': scene}",
    "a name with a dot": "scene = {'type': 'scene', 'a.b': {'type': 'sphere'}}",
    "nothing in it": "",
    "a syntax error": "def scene(:",
    "a NUL": "x = '\0'",
    "no encoding that is known": "# -*- coding: no-such -*-\nscene = 1",
    "tabs and blanks": "if 1:\n\tx = 1\n        y = 2",
}  # fmt: skip

LIVES = {
    "another folder": "os.chdir('/')",
    "a folder that is gone": "os.mkdir('x')\nos.chdir('x')\nos.rmdir('../x')",
    "a umask of 777": "os.umask(0o777)",
    "an empty environment": "os.environ.clear()",
    "another TMPDIR": "os.environ['TMPDIR'] = '/nowhere'",
    "no threads for BLAS": "os.environ['OMP_NUM_THREADS'] = '0'",
    "other arguments": "sys.argv[:] = ['x']\nsys.path.clear()",
    "a child left behind": "subprocess.Popen(['sleep', '1000'])",
    "a fork": "os.fork()",
    "a fork that sleeps": "if os.fork() == 0:\n  time.sleep(1000)\n  os._exit(0)",
    "two forks": "if os.fork() == 0:\n  os.fork()\n  time.sleep(1000)\n  os._exit(0)",
    "a fork with a session of its own":
        "if os.fork() == 0:\n  os.setsid()\n  time.sleep(1000)\n  os._exit(0)",
    "a child with a session of its own":
        "subprocess.Popen(['sleep', '1000'], start_new_session=True)",
    "a thread left behind": "threading.Thread(target=time.sleep, args=(1000,)).start()",
    "a daemon thread":
        "threading.Thread(target=time.sleep, args=(1000,), daemon=True).start()",
    "10 MB of output": "print('x' * 10**7)",
    "bytes on descriptor 1": "os.write(1, b'\\xff\\x00' * 100)",
    "standard output closed": "sys.stdout.close()\nos.close(1)",
    "standard error closed": "sys.stderr = None",
    "standard input closed": "os.close(0)",
    "signals ignored":
        "for n in (signal.SIGTERM, signal.SIGINT): signal.signal(n, signal.SIG_IGN)",
    "an alarm later": "signal.signal(signal.SIGALRM, lambda *_: None)\nsignal.alarm(1)",
    "an atexit that raises": "import atexit\natexit.register(lambda: 1 / 0)",
    "a trace function": "sys.settrace(lambda *_: None)",
    "another variant": "import mitsuba as mi\nmi.set_variant('scalar_rgb')",
    "a plugin of its own":
        "import mitsuba as mi\n"
        "mi.register_bsdf('own', lambda p: mi.load_dict({'type': 'diffuse'}))",
    "the random seed": "import random\nrandom.seed(1)",
    "a log level": "import mitsuba as mi\nmi.set_log_level(mi.LogLevel.Trace)",
    "no collection of garbage": "import gc\ngc.disable()",
    "SIGSTOP and SIGCONT": "os.system('(kill -STOP $PPID; sleep 1; kill -CONT $PPID) &')",
}  # fmt: skip
"""What neither this scene nor another is to be hurt by."""

SABOTAGES = {
    "its own file deleted": "os.remove(__file__)",
    "print replaced": "import builtins\nbuiltins.print = builtins.open = None",
    "json.dumps replaced": "import json\njson.dumps = None",
    "NumPy's errors raised": "import numpy\nnumpy.seterr(all='raise')",
    "a recursion limit of 200": "sys.setrecursionlimit(200)",
    "a limit of 60 open files":
        "import resource\nresource.setrlimit(resource.RLIMIT_NOFILE, (60, 60))",
}  # fmt: skip
"""What may hurt this scene, with a message, but no other."""

NEVER_ENDS = {
    "a loop": "while True: pass",
    "a sleep": "time.sleep(10000)",
    "a pipe that is read": "os.mkfifo('p')\nopen('p').read()",
    "a lock taken twice": "lock = threading.Lock()\nlock.acquire()\nlock.acquire()",
    "SIGSTOP to itself": "os.kill(os.getpid(), signal.SIGSTOP)",
    "a child that is waited for": "subprocess.run(['sleep', '10000'])",
    "a loop without signals":
        "signal.pthread_sigmask(signal.SIG_BLOCK, range(1, 30))\nwhile True: time.sleep(1)",
    "prints without end": "while True: print('x', file=sys.stderr); time.sleep(0.01)",
}  # fmt: skip

TO_PARENT = {"SIGTERM": 143, "SIGINT": 130, "SIGHUP": 129}


def faults() -> Iterator[Fault]:
    """Yield faults of scripts."""
    one = compare("bad.py")
    for name, code in DIES.items():
        limit = ("--timeout", "30")
        yield Fault(name, (*one, *limit), "bad.*(ended|died|killed|progress)", (1,), _script(code))
    for name, code in RAISES.items():
        prepare = then(_script(code), written({"broken.py": "def :"}))
        yield Fault(name, one, "^fotismos: error: bad", (1, 2), prepare)
    for name, code in TYPES.items():
        prepare = written({"bad.py": code})
        yield Fault(f"in place of a scene: {name}", one, "^fotismos: error: bad", (2,), prepare)
    for number, (name, code) in enumerate(LIVES.items()):
        prepare = then(_script(code, GOOD), written({"good.xml": SCENE}))
        # Every third one beside another scene, which has to be compared in any case.
        with_another = number % 3 == 0
        words = compare("bad.py", "good.xml") if with_another else one
        leaves = ("out/good/comparison.json",) if with_another else ()
        yield Fault(name, words, "bad", (0,), prepare, RESULTS, leaves, ours=("bad.py",))
    for name, code in SABOTAGES.items():
        prepare = then(_script(code, GOOD), written({"good.xml": SCENE}))
        words = compare("bad.py", "good.xml")
        leaves = ("out/good/comparison.json",)
        yield Fault(name, words, "bad", (0, 1, 2), prepare, RESULTS, leaves, ours=("bad.py",))
    for name, code in NEVER_ENDS.items():
        words = (*one, "--timeout", "12")
        yield Fault(f"without end: {name}", words, "no progress for 12 s", (1,), _script(code))
    for name, code in TO_PARENT.items():
        prepare = _script(f"{PARENT}os.kill(parent, signal.{name})\ntime.sleep(100)")
        yield Fault(f"{name} to the command", one, "interrupted", (code,), prepare)
    yield from _others()


def _others() -> Iterator[Fault]:
    prepare = _script(f"{PARENT}os.kill(parent, signal.SIGKILL)\ntime.sleep(100)")
    yield Fault("SIGKILL to the command", compare("bad.py"), None, (-9, 137), prepare)
    folder = then(_script("os._exit(0)", GOOD), written({"good.xml": SCENE}))
    there = lambda place: (place / "bad.py").rename(_made(place / "s") / "bad.py")  # noqa: E731
    for command in ("plan", "cost", "fit"):
        words = (command, "bad.py", *(() if command == "plan" else ("-o", "out")), *SMALL)
        yield Fault(f"{command} of os._exit(0)", words, "bad.*exit code 0", (1,), folder)
        yield Fault(f"{command} of an exception", words, "of its own", (2,),
                    _script(RAISES["an exception"]))  # fmt: skip
    yield Fault("scripts of a folder unasked", compare("s"), "--scripts", (2,), then(folder, there))
    yield Fault("scripts of a folder", (*compare("s"), "--scripts"), "exit code 0", (1,),
                then(folder, there))  # fmt: skip
    yield Fault("a batch of a death and a scene", compare("bad.py", "good.xml"), "exit code 0",
                (1,), folder, leaves=("out/good/comparison.json", "out/run.json"))  # fmt: skip
    yield Fault("a batch of a loop and a scene",
                (*compare("bad.py", "good.xml"), "--timeout", "60"), "60 s without", (1,),
                then(_script("time.sleep(1000)"), written({"good.xml": SCENE})),
                leaves=("out/good/comparison.json", "out/index.html"))  # fmt: skip
    yield Fault("a script without rights", compare("bad.py"), "denied", (2,),
                then(_script(""), lambda place: (place / "bad.py").chmod(0)),
                shell=UNPRIVILEGED + '"$@"')  # fmt: skip
    away = "import shutil\nshutil.rmtree(Path(__file__).parent / 'own')"
    yield Fault("a folder of its own deleted", compare("own/bad.py"), "bad", (0,),
                written({"own/bad.py": HEAD + away + "\n" + GOOD}), RESULTS,
                ours=("own", "own/*"))  # fmt: skip


def _made(folder):
    folder.mkdir()
    return folder


def _script(code: str, after: str = ""):
    return written({"bad.py": f"{HEAD}\n{code}\n{after}"})
