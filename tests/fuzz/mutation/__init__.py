"""How inputs are changed; each change is a plain function of a random generator and some bytes.

    flips.py      any file: bits, bytes, numbers of every width, runs cut out, doubled or moved
    words.py      text, and the text that a binary file begins with: words, numbers and lines
    documents.py  JSON, and the JSON of a GLB: values, keys and whole branches

One file that was changed is a pure function of the generator, so a seed gives the same files.
"""
