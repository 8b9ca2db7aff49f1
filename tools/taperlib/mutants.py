"""Mutants of a C file: the same text with one small mistake, as people make them.

Works on tokens, so that nothing is changed within comments, strings and preprocessor lines but the numbers of #define.
A mutant that does not compile is none.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

TOKEN = re.compile(
    r"""(?P<comment>/\*.*?\*/|//[^\n]*)
      | (?P<string>"(?:\\.|[^"\\\n])*"|'(?:\\.|[^'\\\n])*')
      | (?P<number>\b(?:0[xX][0-9a-fA-F]+|\d+)[uUlL]*\b)
      | (?P<word>[A-Za-z_]\w*)
      | (?P<operator><<=|>>=|\+\+|--|->|<<|>>|<=|>=|==|!=|&&|\|\||[-+*/%&|^]=|[-+*/%&|^<>=!~?:;,.(){}\[\]\#])
      | (?P<line_end>\\?\n)""",
    re.VERBOSE | re.DOTALL,
)

# What an operator may be mistaken for. Both neighbours of a comparison: the boundary, and the opposite.
SWAPS: dict[str, tuple[str, ...]] = {
    "<": ("<=", ">="), "<=": ("<", ">"), ">": (">=", "<="), ">=": (">", "<"),
    "==": ("!=",), "!=": ("==",), "&&": ("||",), "||": ("&&",),
    "+": ("-",), "-": ("+",), "*": ("/",), "/": ("*",), "%": ("*",),
    "+=": ("-=",), "-=": ("+=",), "++": ("--",), "--": ("++",),
    "<<": (">>",), ">>": ("<<",), "|": ("&",), "^": ("|",), "|=": ("&=",), "^=": ("|=",),
}  # fmt: skip
BINARY_ONLY = {"+", "-", "*", "&"}
WORDS: dict[str, str] = {
    "true": "false", "false": "true", "taper_min_i32": "taper_max_i32", "taper_max_i32": "taper_min_i32",
}  # fmt: skip
STATEMENT_STARTS = {";", "{", "}", ":"}
NOT_A_STATEMENT = {
    "return", "if", "for", "while", "switch", "case", "default", "else", "do", "const", "static", "struct", "typedef",
    "int", "unsigned", "bool", "extern", "enum", "union", "goto", "void",
}  # fmt: skip


@dataclass(frozen=True)
class Token:
    kind: str
    text: str
    start: int
    in_define: bool

    @property
    def end(self) -> int:
        return self.start + len(self.text)


@dataclass(frozen=True)
class Mutant:
    """One change: text[start:end] becomes `new`."""

    line: int
    start: int
    end: int
    old: str
    new: str

    def apply(self, text: str) -> str:
        return text[: self.start] + self.new + text[self.end :]

    @property
    def change(self) -> str:
        return f"{' '.join(self.old.split())} -> {self.new or 'nothing'}"


def tokens(text: str) -> list[Token]:
    """Code of `text`, and the values of its #defines; the rest of the preprocessor is left out."""
    found: list[Token] = []
    directive: list[Token] | None = None
    for match in TOKEN.finditer(text):
        kind, part = str(match.lastgroup), match.group()
        if kind == "line_end":
            if not part.startswith("\\"):
                directive = None
        elif kind in ("comment", "string"):
            continue
        elif part == "#" and directive is None:
            directive = []
        elif directive is None:
            found.append(Token(kind, part, match.start(), False))
        else:
            directive.append(Token(kind, part, match.start(), True))
            if directive[0].text == "define" and len(directive) > 2:
                found.append(directive[-1])
    return found


def mutants(text: str) -> list[Mutant]:
    """All mutants of a file, in the order of the text."""
    code = tokens(text)
    found: list[Mutant] = []
    for at, token in enumerate(code):
        for new in _replacements(code, at):
            found.append(_mutant(text, token.start, token.end, new))
        end = _statement_end(code, at)
        if end is not None:
            found.append(_mutant(text, token.start, code[end].start, ""))
    return found


def _mutant(text: str, start: int, end: int, new: str) -> Mutant:
    return Mutant(text.count("\n", 0, start) + 1, start, end, text[start:end], new)


def _replacements(code: list[Token], at: int) -> tuple[str, ...]:
    token = code[at]
    if token.kind == "number":
        return _other_numbers(token.text)
    if token.kind == "word":
        return (WORDS[token.text],) if token.text in WORDS else ()
    if token.text in ("!", "~"):
        return ("",)
    if token.text in BINARY_ONLY and not _is_binary(code, at):
        return ()
    return SWAPS.get(token.text, ())


def _other_numbers(text: str) -> tuple[str, ...]:
    digits = text.rstrip("uUlL")
    value = int(digits, 0)
    return (f"{value + 1}{text[len(digits):]}",) if value > 1 else (f"{1 - value}{text[len(digits):]}",)


def _is_binary(code: list[Token], at: int) -> bool:
    """An operand stands before it. What declares a pointer looks the same; it will not compile."""
    before = code[at - 1] if at > 0 else None
    if before is None or before.in_define != code[at].in_define:
        return False
    return before.kind in ("number", "word") and before.text not in ("return", "case") or before.text in (")", "]")


def _statement_end(code: list[Token], at: int) -> int | None:
    """Index of the `;` of a call, an assignment, a break or a continue that begins at `at`; None if none does."""
    token = code[at]
    if token.in_define or at == 0 or token.text in NOT_A_STATEMENT:
        return None
    if token.kind != "word" and token.text not in ("*", "(", "++", "--"):
        return None
    if code[at - 1].text not in STATEMENT_STARTS | {")"}:
        return None
    if code[at - 1].text == ")" or (token.kind == "word" and code[at + 1].kind == "word"):
        return None  # a condition's brackets stand before braces here; two words are a declaration
    depth = 0
    for end in range(at, len(code)):
        depth += {"(": 1, "[": 1, ")": -1, "]": -1}.get(code[end].text, 0)
        if code[end].text in ("{", "}") or depth < 0:
            return None
        if code[end].text == ";" and depth == 0:
            return end
    return None
