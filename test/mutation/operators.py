"""What a small break of a source in C++ can be, token by token: no text is parsed."""

import hashlib
import re
from typing import NamedTuple

# clang-format puts blanks around a binary operator, and none beside a template's bracket.
OPERATORS = {
    " < ": " <= ",
    " <= ": " < ",
    " > ": " >= ",
    " >= ": " > ",
    " == ": " != ",
    " != ": " == ",
    " + ": " - ",
    " - ": " + ",
    " * ": " / ",
    " / ": " * ",
    " += ": " -= ",
    " -= ": " += ",
    " && ": " || ",
    " || ": " && ",
}
WORDS = {"true": "false", "false": "true", "min": "max", "max": "min", "sin": "cos", "cos": "sin"}

OPERATOR = re.compile("|".join(re.escape(operator) for operator in OPERATORS))
WORD = re.compile(r"(?<![\w.])(?:true|false)\b|(?<=std::)(?:min|max|sin|cos)(?=\()")
NUMBER = re.compile(r"(?<![\w.\"])(?:\d+\.\d*(?:e-?\d+)?|\d+)(?=[fFuUL]*(?![\w.\"]))")
NOT = re.compile(r"(?<=[(\s])!(?=[\w(])")
CONDITION = re.compile(r"^\s*(?:\} else )?(?:if|while) \((?!!)(?P<condition>[^;]*)\) [^()]*$")
ARGUMENTS = re.compile(r"(?<=\w\()(?P<first>[\w.]+), (?P<second>[\w.]+)(?=[,)])")
STATEMENT = re.compile(
    r"^\s*(?!return|throw|break|continue|using|namespace|typedef|delete|goto|case|default|public)"
    r"(?:[\w:.\[\]]|->|\(\))+(?: [-+*/|&]?= .*|\(.*\));$"
)
TEXT = re.compile(r'"(?:\\.|[^"\\])*"|\'(?:\\.|[^\'\\])+\'')
# What is said to people, what the compiler checks alone, and what names a thing and does nothing.
LEFT_OUT = re.compile(
    r"^\s*(?:#|//|/\*|\*|using |namespace |template|friend |class |struct |enum |extern )"
    r"|static_assert|assert\(|ROS_[A-Z]+|throw |operator|NOLINT|reserve\(|\\$"
    r"|\bkill\("  # whom it ends would be anybody's guess
)


class Break(NamedTuple):
    """A line of a file, and what becomes of it. Its `id` is of its words, not of its number."""

    path: str
    number: int
    kind: str
    old: str
    new: str
    id: str

    def __str__(self):
        return f"{self.path}:{self.number}: {self.kind}: {self.old.strip()}  ->  {self.new.strip()}"


def masked(line):
    """The line with nothing to be found in its strings and comments, and all at its place."""
    line = TEXT.sub(lambda match: '"' + "_" * (len(match[0]) - 2) + '"', line)
    code, slashes, comment = line.partition("//")
    return code + "_" * len(slashes + comment)


def nudged(number):
    """The next whole number; a thousandth more of another one."""
    if number.isdigit():
        return str(int(number) + 1)
    return repr(float(number) * 1.001) if float(number) else "0.001"


def variants(line, follows_statement):
    """Kind and new line, for each break of a line.

    Parameters
    ----------
    follows_statement
        Whether a statement may begin here, so that a line which looks like one is a whole one.
    """
    if LEFT_OUT.search(line):
        return
    code = masked(line)

    def put(match, new):
        return line[: match.start()] + new + line[match.end() :]

    for match in OPERATOR.finditer(code):
        yield "operator", put(match, OPERATORS[match[0]])
    for match in WORD.finditer(code):
        yield "word", put(match, WORDS[match[0]])
    for match in NUMBER.finditer(code):
        yield "number", put(match, nudged(match[0]))
    for match in NOT.finditer(code):
        yield "no negation", put(match, "")
    for match in ARGUMENTS.finditer(code):
        if match["first"] != match["second"]:
            yield "arguments", put(match, f"{match['second']}, {match['first']}")
    match = CONDITION.match(code)
    if match and is_balanced(match["condition"]):
        begin, end = match.span("condition")
        yield "negation", f"{line[:begin]}!({line[begin:end]}){line[end:]}"
    if follows_statement and STATEMENT.match(code) and is_balanced(code):
        indent = line[: len(line) - len(line.lstrip())]
        yield "no statement", indent + ";"


def is_balanced(code):
    depth = 0
    for character in code:
        depth += {"(": 1, ")": -1}.get(character, 0)
        if depth < 0:
            return False
    return depth == 0


def breaks_of(path, text):
    """All of a file. Those that say the same of equal lines differ by a count."""
    found, seen, previous = [], {}, ";"
    for number, line in enumerate(text.splitlines(), 1):
        for kind, new in variants(line, previous[-1] in ";{}:"):
            words = f"{path}\n{line.strip()}\n{new.strip()}"
            seen[words] = count = seen.get(words, 0) + 1
            digest = hashlib.sha256(f"{words}\n{count}".encode()).hexdigest()
            found.append(Break(path, number, kind, line, new, digest[:8]))
        code = line.partition("//")[0].rstrip()
        if code and not code.startswith("#"):
            previous = code
    return found


def broken(text, a_break):
    """The file's text with the break in it."""
    lines = text.splitlines(keepends=True)
    index = a_break.number - 1
    if lines[index].rstrip("\n") != a_break.old:
        raise ValueError(
            f"{a_break.path}:{a_break.number}: {lines[index]!r}; must be {a_break.old!r}"
        )
    lines[index] = a_break.new + "\n"
    return "".join(lines)
