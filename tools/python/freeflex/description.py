"""Scenes as a person describes them, before the set-up: a file, a text or a dict, with values set by path."""

import json
import os


class Scene:
    """A scene file, or a scene from a dict or `text` (YAML or JSON), whose values may be set before a Plan is made of it.

        scene = Scene("boom.yaml")
        scene["points.hub.mass"] = 41
        plan = Plan(scene)

    Paths: service/scenes/README.md, "Values set by path". Nothing is checked before the set-up, which checks a value that
    is set as any other and names its path. `folder`: of the files that a dict or a text names; else the working folder.
    """

    def __init__(self, source=None, *, text=None, folder=None):
        if (source is None) == (text is None):
            raise ValueError("a scene is a file, a dict or text=, and one of them")
        self.path, self.text, self.name, self.settings = None, text, "<text>", {}
        if isinstance(source, dict):
            self.text, self.name = as_json(source, "the scene", indent=1), "<dict>"
        elif source is not None:
            self.path = os.fsencode(source)
            if folder is not None:
                raise ValueError("folder= goes with a dict or a text: the files that a file names are beside it")
        for what, value in (("path", self.path), ("text", self.text)):
            if value is not None and (b"\0" if isinstance(value, bytes) else "\0") in value:
                raise ValueError(f"the {what} of a scene holds a zero byte")
        self.folder = os.fsencode(folder) if folder is not None else None

    def __setitem__(self, path, value):
        """Sets a value: a number, a string, a list or a dict. What is set last counts."""
        if not isinstance(path, str) or not path or "\0" in path:
            raise ValueError(f"{path!r} is no path of a value, as points.hub.mass")
        self.settings.pop(path, None)
        self.settings[path] = as_json(value, path)

    def __getitem__(self, path):
        """A value that was set. KeyError of any other, which only the set-up reads."""
        return json.loads(self.settings[path])

    def __delitem__(self, path):
        """Leaves the value as the scene has it."""
        del self.settings[path]

    def __repr__(self):
        source = os.fsdecode(self.path) if self.path is not None else self.name
        return f"Scene({source!r}, {', '.join(f'{k} = {v}' for k, v in self.settings.items())})"


def as_json(value, what, indent=None):
    """JSON, which scenes take. ValueError: not finite, or of no type of a scene."""
    try:
        return json.dumps(value, allow_nan=False, ensure_ascii=False, indent=indent, default=_plain)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{what}: {error}") from None


def _plain(value):
    """A list or a number in place of one of numpy."""
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"{value!r} is no number, string, list or dict")
