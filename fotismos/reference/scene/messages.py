"""Mitsuba's messages in plain words: what is wrong, what is allowed, what to do next."""

import re
from collections.abc import Callable
from pathlib import Path

import mitsuba as mi

from fotismos.heuristic import plugins
from fotismos.heuristic.errors import suggestion

MITSUBA = Path(mi.__file__).parent
LIBRARIES = ".so", ".dylib", ".dll"

IDENTIFIER = re.compile(rb"(?<![\w.])[a-z][A-Za-z0-9_]{1,40}(?=[\0\"'`])")
"""A name in a library or a module, such as that of a parameter."""

SHORTEST_NAME = 3
"""Letters of a name that is suggested; shorter ones are near to anything."""

NEAR = 0.65
NEARER = 0.75
"""How near a suggested name is: libraries hold words that are no parameters, the main one many."""

CONTENT = re.compile(r'((?:of spectrum file "[^"]*"|PLY header: unknown token))[: ]*".*', re.DOTALL)
"""Ends of messages that repeat a line of a file, which may be any file."""

LONG = re.compile(r'("[^"]{60})[^"]+([^"]{20})(?=")')

INCLUDES = re.compile(r"(?:.* while processing <include>:\n)+(?=.* while processing <include>:\n)")
"""All but the innermost of the files that include each other, a line each."""

SOURCE = re.compile(r"\[\w+\.(?:cpp|h):\d+\] ")
"""The line of Mitsuba's own code."""


def plain_message(error: BaseException) -> str:
    """Return Mitsuba's message without what a file holds; for a Python plugin, its own message."""
    text = str(error).strip()
    if isinstance(error, UnicodeDecodeError):
        text = error.object.decode("utf-8", "replace")
    if "Traceback" in text:
        location, _, trace = text.partition(": failed to instantiate")
        text = f"{location}: {trace.splitlines()[-1].partition(': ')[2]}"
    text = SOURCE.sub("", LONG.sub(r"\1…\2", CONTENT.sub(r"\1", INCLUDES.sub("", text))))
    for pattern, words in PLAIN_WORDS:
        text = pattern.sub(words, text)
    return text


def _plugin(match: re.Match[str]) -> str:
    names = {path.stem for path in (MITSUBA / "plugins").iterdir() if path.suffix in LIBRARIES}
    return f'plugin "{match[1]}" not found{suggestion(match[1], names | set(plugins.PLUGINS))}.'


def _parameters(match: re.Match[str]) -> str:
    plugin = match[1]
    files = [MITSUBA / "plugins" / f"{plugin}{end}" for end in LIBRARIES]
    if plugin in plugins.PLUGINS:
        files = [Path(plugins.__file__).with_name(f"{plugins.PLUGINS[plugin][1]}.py")]
    # What all plugins of a kind have is in the main library.
    main = [MITSUBA / f"{prefix}mitsuba{end}" for prefix in ("lib", "") for end in LIBRARIES]
    words = []
    for name in re.findall(r'- [^"\n]+ "([^"]*)":', match[2]):
        near = suggestion(name, _names_in(files) - {name}, NEAR)
        near = near or suggestion(name, _names_in(main) - {name}, NEARER)
        words.append(f'"{name}"{near}')
    return f"{plugin} has no parameter {', '.join(words)}. Correct the name, or omit it."


def _names_in(files: list[Path]) -> set[str]:
    """Return what may be names of parameters in a plugin's code; libraries share ends of words."""
    whole = [
        name.decode()
        for path in files
        if path.is_file()
        for name in IDENTIFIER.findall(path.read_bytes())
    ]
    ends = {
        "_".join(name.split("_")[first:]) for name in whole for first in range(name.count("_") + 1)
    }
    return {name for name in ends if len(name) >= SHORTEST_NAME}


def _metal(match: re.Match[str]) -> str:
    known = {
        path.name.removesuffix(".eta.spd") for path in (MITSUBA / "data/ior").glob("*.eta.spd")
    }
    shown = sorted(name for name in known if not name.endswith("_palik"))
    return f'material "{match[1]}" is not known: choose one of {", ".join(shown)}.'


PLAIN_WORDS: tuple[tuple[re.Pattern[str], str | Callable[[re.Match[str]], str]], ...] = (
    (re.compile(r'\[PluginManager\] Plugin "([^"]*)" not found!'), _plugin),
    (
        re.compile(r'Found \d+ unreferenced propert\w+ in \w+ plugin of type "(\w+)":\n(.*)', re.S),
        _parameters,
    ),
    (re.compile(r'"data/ior/([^"]*)\.(?:eta|k)\.spd": file does not exist!'), _metal),
    (
        re.compile(r"\[\w+\] Invalid RGB reflectance value \[(.*?)\].*", re.S),
        r"the reflectance \1 is not allowed: give values from 0 to 1, as no surface returns more"
        r" light than it receives.",
    ),
    (
        re.compile("maximum recursion depth exceeded.*", re.S),
        "its elements are nested too deeply, such as masks within masks. Give fewer.",
    ),
    (
        re.compile(r"\w+Distribution: no probability mass found!"),
        r"one of its spectra is 0 at all visible wavelengths. Give others, or another `material`.",
    ),
    (
        re.compile(
            r'\[BitmapTexture[^]]*\]+ \w+\(\): The bitmap texture \w+\[\s*name = "(.*?)".*?\n\] ',
            re.S,
        ),
        r'the picture "\1" ',
    ),
    (
        re.compile(
            r'(?:\[FileStream\] )?"([^"]*)": (?:file does not exist!|I/O error.*: No such file.*)'
        ),
        r'"\1" is missing. Correct the path, or add the file.',
    ),
)
"""What Mitsuba says, and plainer words for it."""
