"""Joins the pages of SCENE, POINTS, LOADS and SHAPES, and maps names to the indices of messages."""

import difflib

from freeflex.state import vector


KINDS = ("point", "link", "group", "wheel")
#: [bytes] limit of the pages of one set, such as a tick of POINTS; a tick of 200,000 points has 20 MB
MOST_BYTES = 64 << 20
#: limit of the number of pages of one set while the scene, and therefore the number of its items, is unknown
MOST_PAGES = 2048


class Pages:
    """Collects the pages of one set, such as a tick of POINTS. `add` returns all pages once they are complete. A page
    of another set starts a new collection.

    Keeps at most `MOST_BYTES`, whatever pages any program on the bus sends.
    """

    def __init__(self):
        self._of, self._pages, self._size = None, {}, 0

    def add(self, of, message, size, most=MOST_PAGES):
        """Adds a page. Returns all pages in order if the set is now complete, else None.

        `of`: identifies the set; `size` [bytes] of the message; `most`: largest number of pages, one for each point or
        link that the scene publishes. A page that claims a larger number is ignored.
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
    """The names and properties of its scene that a daemon publishes.

    `name`, `plan_file`, `plan_fingerprint`, `session`, `rate` [Hz], `mass` [kg], `inertia` [kg m^2],
    `rigid_freedoms`; `points`, `links`, `groups`, `wheels`: indices by name, as in a Plan; `listed`: the message about
    each item, for example `listed["point"][3].mass`; `frequencies` [Hz] of the elastic modes, in the order of a state's
    `q`. If a scene has more than 1000 points, the daemon lists only the points that the scene names.
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
        #: largest number of pages of one tick of POINTS or LOADS; a point with an attitude has a second item
        self.most_point_pages = 2 * published["point"] + len(self.listed["group"])
        self.most_load_pages = published["link"]

    def index(self, kind, name):
        """Returns the index of the point, link, group or wheel with this name; an index is returned unchanged.
        LookupError: unknown."""
        check_kind(kind)
        if isinstance(name, int):
            return name
        return index_in(self._indices[kind], kind, name)


def indices_of(numbered):
    """Returns {name: index} from pairs of index and name. If several names are equal, the first index is returned."""
    indices = {}
    for k, name in numbered:
        indices.setdefault(name, k)
    return indices


def check_kind(kind):
    """Checks a kind. LookupError: it is not one of KINDS."""
    if kind not in KINDS:
        raise LookupError(f"there is no kind {kind!r}; it must be one of {', '.join(KINDS)}")


def index_in(indices, kind, name):
    """Returns the index of a name. LookupError: unknown; the text lists similar names."""
    if name in indices:
        return indices[name]
    close = difflib.get_close_matches(str(name), list(indices)[:10000], 5, 0.5) or list(indices)[:5]
    raise LookupError(f"there is no {kind} {name!r}; there " + (f"are {', '.join(close)}"
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
    """One tick of LOADS: `tick`, `epoch`; `links`: values by index (messages/README.md, section 7)."""

    def __init__(self, pages):
        self.tick, self.epoch = pages[0].tick, pages[0].epoch
        self.links = {one.link: one.values for page in pages for one in page.links}
