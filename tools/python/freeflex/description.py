"""Scenes before the set-up: a file, a text or a dict, in which values can be set by path."""

import json
import os


class Scene:
    """A scene from a file, a dict or `text` (YAML or JSON). Its values may be set before a Plan is made from it.

        scene = Scene("boom.yaml")
        scene["points.hub.mass"] = 41
        plan = Plan(scene)

    Paths: service/scenes/README.md, "Values set by path". The set-up checks a value that is set here like any other
    value, and its errors contain the path. `folder`: folder of the files that a dict or a text names; default: the working
    folder.
    """

    def __init__(self, source=None, *, text=None, folder=None):
        if (source is None) == (text is None):
            raise ValueError("give a scene as exactly one of a file, a dict and text=")
        self.path, self.text, self.name, self.settings = None, text, "<text>", {}
        if isinstance(source, dict):
            self.text, self.name = as_json(source, "the scene", indent=1), "<dict>"
        elif source is not None:
            self.path = os.fsencode(source)
            if folder is not None:
                raise ValueError("folder= needs a dict or a text, because the files that a scene file names are relative to its folder")
        for what, value in (("path", self.path), ("text", self.text)):
            if value is not None and (b"\0" if isinstance(value, bytes) else "\0") in value:
                raise ValueError(f"the {what} of a scene contains a zero byte")
        self.folder = os.fsencode(folder) if folder is not None else None

    def __setitem__(self, path, value):
        """Sets a value: a number, a string, a list or a dict. If a path is set twice, the last value is used."""
        if not isinstance(path, str) or not path or "\0" in path:
            raise ValueError(f"{path!r} is not the path of a value; a path is points.hub.mass, for example")
        self.settings.pop(path, None)
        self.settings[path] = as_json(value, path)

    def __getitem__(self, path):
        """Returns a value that was set here. KeyError: the value was not set here; only the set-up reads the scene's
        own values."""
        return json.loads(self.settings[path])

    def __delitem__(self, path):
        """Removes a value that was set, so that the scene's own value is used."""
        del self.settings[path]

    def __repr__(self):
        source = os.fsdecode(self.path) if self.path is not None else self.name
        return f"Scene({source!r}, {', '.join(f'{k} = {v}' for k, v in self.settings.items())})"


def as_json(value, what, indent=None):
    """Returns a value as JSON, which scenes accept. ValueError: a number is not finite, or scenes do not have the
    type."""
    try:
        return json.dumps(value, allow_nan=False, ensure_ascii=False, indent=indent, default=_plain)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{what}: {error}") from None


def _plain(value):
    """Converts an array or number of numpy to a list or number."""
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"{value!r} is not a number, string, list or dict")
