"""What the indices of messages mean: the pages of SCENE, and of POINTS, LOADS and SHAPES, put together."""

import difflib

from freeflex.state import vector


KINDS = ("point", "link", "group", "wheel")
#: [bytes] of pages that one thing may have: a tick of 200,000 points has 22 MB
MOST_BYTES = 64 << 20
#: pages of a thing while the scene is not known that says how many items there are
MOST_PAGES = 2048


class Pages:
    """Pages of one thing; `add` returns all of them once they are there. Those of another thing begin anew.

    Holds no more than `MOST_BYTES`, whatever pages anybody on the bus sends.
    """

    def __init__(self):
        self._of, self._pages, self._size = None, {}, 0

    def add(self, of, message, size, most=MOST_PAGES):
        """All pages in their order once the last one came, else None.

        `of`: what tells the thing from others; `size` [bytes] of the message; `most`: the pages that the thing has at
        most, one for each item that the scene publishes. A page that claims more is left.
        """
        if not (1 <= message.num_pages <= most and 0 <= message.page < message.num_pages):
            return None
        if of != self._of:
            self._of, self._pages, self._size = of, {}, 0
        if message.page in self._pages or self._size + size > MOST_BYTES:
            return None
        self._pages[message.page] = message
        self._size += size
        if len(self._pages) < message.num_pages:
            return None
        pages = [self._pages[k] for k in sorted(self._pages)]
        self._of, self._pages, self._size = None, {}, 0
        return pages


class Listing:
    """What a daemon lists of its scene.

    `name`, `plan_file`, `plan_fingerprint`, `session`, `rate` [Hz], `mass` [kg], `inertia` [kg m^2],
    `rigid_freedoms`; `points`, `links`, `groups`, `wheels`: indices by name, as a Plan has them; `listed`: the message
    about each, as `listed["point"][3].mass`; `frequencies` [Hz] of the elastic modes, in the order of a state's `q`.
    Above 1000 points a daemon lists those alone that are named.
    """

    def __init__(self, pages):
        front = pages[0]
        for name in ("name", "plan_file", "plan_fingerprint", "session", "rate", "mass", "inertia", "rigid_freedoms"):
            setattr(self, name, getattr(front, name))
        self.listed = {"point": {}, "link": {}, "group": {}, "wheel": dict(enumerate(front.wheels))}
        frequencies = []
        for page in pages:
            self.listed["point"].update(enumerate(page.points, page.first_point))
            self.listed["link"].update(enumerate(page.links, page.first_link))
            self.listed["group"].update(enumerate(page.groups, page.first_group))
            frequencies += page.frequencies
        self.frequencies = vector(frequencies)
        self._indices = {kind: indices_of((k, one.name) for k, one in listed.items())
                         for kind, listed in self.listed.items()}
        self.points, self.links, self.groups, self.wheels = self._indices.values()
        published = {kind: sum(1 for one in self.listed[kind].values() if one.is_published) for kind in ("point", "link")}
        #: pages that one tick of POINTS or LOADS has at most; a point has a pose too where it turns
        self.most_point_pages = 2 * published["point"] + len(self.listed["group"])
        self.most_load_pages = published["link"]

    def index(self, kind, name):
        """Index of a point, link, group or wheel by its name; an index is itself. LookupError: none of it."""
        check_kind(kind)
        if isinstance(name, int):
            return name
        return index_in(self._indices[kind], kind, name)


def indices_of(numbered):
    """{name: index} of pairs of index and name; of a name that several have, the first."""
    indices = {}
    for k, name in numbered:
        indices.setdefault(name, k)
    return indices


def check_kind(kind):
    """LookupError: not one of KINDS."""
    if kind not in KINDS:
        raise LookupError(f"no kind {kind!r}, must be one of {', '.join(KINDS)}")


def index_in(indices, kind, name):
    """Index of a name. LookupError that tells names like it."""
    if name in indices:
        return indices[name]
    close = difflib.get_close_matches(str(name), list(indices)[:10000], 5, 0.5) or list(indices)[:5]
    raise LookupError(f"no {kind} {name!r}; there " + (f"are {', '.join(close)}"
                      + (f" and {len(indices) - len(close)} more" if len(indices) > len(close) else "")
                      if indices else "is none"))


class Points:
    """One tick of POINTS: `tick`, `epoch`; `points`, `groups`, `bodies` by index."""

    def __init__(self, pages):
        self.tick, self.epoch = pages[0].tick, pages[0].epoch
        self.points = {one.point: one for page in pages for one in page.points}
        self.groups = {one.group: one for page in pages for one in page.groups}
        self.bodies = {one.point: one for page in pages for one in page.bodies}


class Loads:
    """One tick of LOADS: `tick`, `epoch`; `links`: the values of each, by index (messages/README.md, section 7)."""

    def __init__(self, pages):
        self.tick, self.epoch = pages[0].tick, pages[0].epoch
        self.links = {one.link: one.values for page in pages for one in page.links}
