"""Read numbers out of text files: the inner loops of the OBJ, PLY, STL and OFF readers.

Text is (n,) uint8.  A line ends at CR, LF or both.  Blanks are space, tab, vertical tab and form
feed; a backslash at the end of a line joins it to the next one; a word that begins with ``#``
starts a comment, which ends with the line even behind a backslash (a Windows folder may end it).

Numbers of at most 2**53 and 22 decimals are converted here and are correctly rounded: both the
digits and the power of ten are then exact in float64, and one operation joins them (Clinger, "How
to Read Floating Point Numbers Accurately", 1990).  All others, and words that are no number at all,
are left to the caller, who finds their place in ``hard``.
"""

from __future__ import annotations

import numpy as np

from simplifier.kernels.compiled.kernel import inline_kernel, inner_kernel, kernel

_POWERS = np.array([10.0**i for i in range(23)])
_EXACT = 2**53
_HASH, _SLASH, _BACKSLASH = 35, 47, 92
_PLUS, _MINUS, _DOT = 43, 45, 46


@inline_kernel
def _is_newline(c):
    return c == 10 or c == 13


@inline_kernel
def _is_blank(c):
    return c == 32 or c == 9 or c == 11 or c == 12


@inline_kernel
def _is_digit(c):
    return c >= 48 and c <= 57


@inner_kernel
def _joint(text, i):
    """Length of the line continuation at ``i``, or 0."""
    if text[i] != _BACKSLASH or i + 1 >= text.size or not _is_newline(text[i + 1]):
        return 0
    if text[i + 1] == 13 and i + 2 < text.size and text[i + 2] == 10:
        return 3
    return 2


@inner_kernel
def _skip_blanks(text, i):
    while i < text.size:
        if _is_blank(text[i]):
            i += 1
        elif text[i] == _BACKSLASH and _joint(text, i) > 0:
            i += _joint(text, i)
        else:
            break
    return i


@inner_kernel
def _word_end(text, i):
    while i < text.size:
        c = text[i]
        # One comparison settles most bytes: all that can end a word are no greater than a blank.
        if c <= 32 and (_is_blank(c) or _is_newline(c)):
            break
        if c == _BACKSLASH and _joint(text, i) > 0:
            break
        i += 1
    return i


@inner_kernel
def _line_end(text, i):
    """The end of the line from ``i`` on, where a word begins or ends or a blank is."""
    blank = True
    comment = False
    while i < text.size:
        c = text[i]
        if c > _HASH and c != _BACKSLASH:
            blank = False
        elif _is_newline(c):
            break
        elif c == _HASH:
            comment = comment or blank
            blank = False
        elif c == _BACKSLASH:
            joint = 0 if comment else _joint(text, i)
            blank = joint > 0
            i += max(joint - 1, 0)
        else:
            blank = _is_blank(c)
        i += 1
    return i


@inline_kernel
def _at_end(text, i):
    """Whether nothing but a comment is left of the line."""
    return i >= text.size or _is_newline(text[i]) or text[i] == _HASH


@inner_kernel
def _decimal(text, begin, end):
    """(value, True) of the word, or (0, False) when it takes more than exact arithmetic."""
    i = begin
    negative = text[i] == _MINUS
    if negative or text[i] == _PLUS:
        i += 1
    mantissa = 0
    decimals = 0
    digits = 0
    after_dot = False
    while i < end:
        c = text[i]
        if _is_digit(c):
            mantissa = mantissa * 10 + (np.int64(c) - 48)
            if mantissa > _EXACT:
                return 0.0, False
            digits += 1
            decimals += after_dot
        elif c == _DOT and not after_dot:
            after_dot = True
        else:
            break
        i += 1
    if digits == 0:
        return 0.0, False
    exponent = 0
    if i + 1 < end and (text[i] == 69 or text[i] == 101):
        i += 1
        downwards = text[i] == _MINUS
        if downwards or text[i] == _PLUS:
            i += 1
        if i == end:
            return 0.0, False
        while i < end and _is_digit(text[i]) and exponent < 1000:
            exponent = exponent * 10 + (np.int64(text[i]) - 48)
            i += 1
        if downwards:
            exponent = -exponent
    exponent -= decimals
    if i != end or exponent > 22 or exponent < -22:
        return 0.0, False
    value = float(mantissa)
    if exponent >= 0:
        value *= _POWERS[exponent]
    else:
        value /= _POWERS[-exponent]
    return (-value if negative else value), True


@kernel("uint8[:], int64")
def count_words(text, begin):
    """(words, lines that have one) from ``begin`` on, comments left out."""
    words = 0
    lines = 0
    i = begin
    while i < text.size:
        i = _skip_blanks(text, i)
        if not _at_end(text, i):
            lines += 1
        while not _at_end(text, i):
            words += 1
            i = _skip_blanks(text, _word_end(text, i))
        i = _line_end(text, i) + 1
    return words, lines


@kernel("uint8[:], int64, float64[:], int64[:], int64[:]")
def read_words(text, begin, values, hard, firsts):
    """Convert every word from ``begin`` on; the arrays are sized by :func:`count_words`.

    ``values``  (words,) float64.
    ``hard``    (words,) int64: where the word begins if it was left to the caller, else -1.
    ``firsts``  (lines,) int64: index of the first word of each line that has one.
    """
    word = 0
    line = 0
    i = begin
    while i < text.size:
        i = _skip_blanks(text, i)
        if not _at_end(text, i):
            firsts[line] = word
            line += 1
        while not _at_end(text, i):
            end = _word_end(text, i)
            values[word], easy = _decimal(text, i, end)
            hard[word] = -1 if easy else i
            word += 1
            i = _skip_blanks(text, end)
        i = _line_end(text, i) + 1


@inner_kernel
def _has_keyword(text, begin, end, keyword):
    """Whether the word is ``keyword`` (given in lower case), in either case."""
    if end - begin != keyword.size:
        return False
    for k in range(keyword.size):
        c = text[begin + k]
        if c >= 65 and c <= 90:
            c += 32
        if c != keyword[k]:
            return False
    return True


@kernel("uint8[:], uint8[:]")
def count_statements(text, keyword):
    """How many lines begin with the word ``keyword`` ((k,) uint8, lower case)."""
    count = 0
    i = 0
    while i < text.size:
        i = _skip_blanks(text, i)
        count += _has_keyword(text, i, _word_end(text, i), keyword)
        i = _line_end(text, i) + 1
    return count


@kernel("uint8[:], uint8[:], float64[:, :], int64[:, :]")
def read_statements(text, keyword, values, hard):
    """Convert the first words after ``keyword`` on each line that begins with it.

    ``values`` (lines, width) float64 and ``hard`` (lines, width) int64 as in :func:`read_words`;
    further words of a line are ignored.  Returns -1, or where the line begins that is too short.
    """
    row = 0
    i = 0
    while i < text.size:
        i = _skip_blanks(text, i)
        begin = i
        end = _word_end(text, i)
        if _has_keyword(text, begin, end, keyword):
            i = end
            for column in range(values.shape[1]):
                i = _skip_blanks(text, i)
                if _at_end(text, i):
                    return begin
                end = _word_end(text, i)
                values[row, column], easy = _decimal(text, i, end)
                hard[row, column] = -1 if easy else i
                i = end
            row += 1
        i = _line_end(text, i) + 1
    return -1


@inline_kernel
def _is_letter(text, begin, end, letter):
    """Whether the word is the one letter, given in lower case, in either case."""
    return end == begin + 1 and (text[begin] | 32) == letter


@kernel("uint8[:]")
def count_obj_corners(text):
    """(``f`` lines, corners on them) of an OBJ file."""
    faces = 0
    corners = 0
    i = 0
    while i < text.size:
        i = _skip_blanks(text, i)
        end = _word_end(text, i)
        if _is_letter(text, i, end, 102):
            faces += 1
            i = _skip_blanks(text, end)
            while not _at_end(text, i):
                corners += 1
                i = _skip_blanks(text, _word_end(text, i))
        i = _line_end(text, i) + 1
    return faces, corners


@inner_kernel
def _obj_index(text, begin, end):
    """The integer before the first slash of the word, or 0 (which OBJ does not allow)."""
    i = begin
    negative = text[i] == _MINUS
    if negative or text[i] == _PLUS:
        i += 1
    index = 0
    while i < end and _is_digit(text[i]) and index < _EXACT:
        index = index * 10 + (np.int64(text[i]) - 48)
        i += 1
    if i < end and text[i] != _SLASH:
        return 0
    return -index if negative else index


@kernel("uint8[:], int64[:], int64[:]")
def read_obj_corners(text, sizes, corners):
    """Fill the corner count of each ``f`` line and its vertex indices, from 0.

    ``sizes`` (faces,) int64, ``corners`` (corners,) int64, sized by :func:`count_obj_corners`.
    Negative indices count back from the last ``v`` line above.  Nothing is checked against the
    number of vertices.  Returns -1, or where the word begins that is no index.
    """
    face = 0
    corner = 0
    vertices = 0
    i = 0
    while i < text.size:
        i = _skip_blanks(text, i)
        end = _word_end(text, i)
        if _is_letter(text, i, end, 118):
            vertices += 1
        if _is_letter(text, i, end, 102):
            before = corner
            i = _skip_blanks(text, end)
            while not _at_end(text, i):
                end = _word_end(text, i)
                index = _obj_index(text, i, end)
                if index == 0:
                    return i
                corners[corner] = index - 1 if index > 0 else vertices + index
                corner += 1
                i = _skip_blanks(text, end)
            sizes[face] = corner - before
            face += 1
        i = _line_end(text, i) + 1
    return -1
