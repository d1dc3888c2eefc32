"""The forms of a batch, one file each: text to columns, answers to text."""

from importlib.util import find_spec

from ..batch import Form
from . import json

ALL: list[Form] = [*json.FORMS]
if find_spec("pyarrow"):
    from . import arrow, csv

    ALL += [csv.FORM, arrow.FORM]
#: by media type
FORMS = {name: form for form in ALL for name in (form.media_type, *form.aliases)}
