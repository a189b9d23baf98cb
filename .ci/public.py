"""Counts the public items in the folder of the documentation: python3 .ci/public.py target/doc/flexcal

An item is a module, an item with a page of its own (struct, enum, trait, function, constant, type), or a public method. Items and methods
that are hidden from the documentation serve the tests, the benches and the Python module of this repository. Fails above the limit.
"""
import pathlib
import re
import sys

LIMIT = 200

folder = pathlib.Path(sys.argv[1])
pages = set(re.findall(r'<li><a href="([\w/]+\.\w+\.html)"', (folder / "all.html").read_text()))
modules = {page.rpartition("/")[0] for page in pages} - {""}
method = re.compile(r'class="code-header">pub (?:const |async |unsafe )*fn')
methods = sum(len(method.findall((folder / page).read_text())) for page in pages)
total = len(modules) + len(pages) + methods
print(f"{total} public items: {len(modules)} modules, {len(pages)} items with a page, {methods} methods")
sys.exit(total > LIMIT)
