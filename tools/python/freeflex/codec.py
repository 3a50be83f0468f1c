"""Encodes and decodes messages in the format of LCM, which begins with the fingerprint of the type."""

import struct

LETTERS = {"int8_t": "b", "int16_t": "h", "int32_t": "i", "int64_t": "q", "float": "f", "double": "d", "boolean": "b"}
_INT = struct.Struct(">i")


class DecodeError(ValueError):
    """The bytes are not a message of the expected type; the text gives the reason."""


class Message:
    """A message. Its fields are attributes. A field that is not given by name is initially zero or empty.

    Counts of arrays (`num_...`) are not attributes; the lengths of the arrays replace them. An array of fixed size is a
    list of that many numbers; an array of bytes is `bytes`. Two messages are equal if all their fields are equal.
    """

    FIELDS = ()
    FINGERPRINT = 0

    def __init_subclass__(cls):
        counters = {size for _, _, sizes in cls.FIELDS for size in sizes if isinstance(size, str)}
        cls.NAMES = tuple(name for name, _, _ in cls.FIELDS if name not in counters)
        cls._head = cls.FINGERPRINT.to_bytes(8, "big")
        cls._parts = _parts_of(cls, counters)

    def __init__(self, **fields):
        for part in self._parts:
            part.clear(self)
        for name, value in fields.items():
            if name not in self.NAMES:
                raise TypeError(f"{type(self).__name__} has no field {name}; there are {', '.join(self.NAMES)}")
            setattr(self, name, value)

    def encode(self):
        """Returns the message as bytes. ValueError: a value does not fit; the text contains its field."""
        out = [self._head]
        self._write(out)
        return b"".join(out)

    @classmethod
    def decode(cls, data):
        """Decodes all the bytes as one message. DecodeError: they are not a message of this type."""
        if data[:8] != cls._head:
            raise DecodeError(f"the bytes are not a {cls.__name__} of this version of the messages")
        try:
            message, end = cls._read(data, 8)
        except struct.error as error:
            raise DecodeError(f"a {cls.__name__} of {len(data)} bytes cannot be decoded: {error}") from None
        if end != len(data):
            raise DecodeError(f"a {cls.__name__} of {len(data)} bytes ends after {end}")
        return message

    def _write(self, out):
        for part in self._parts:
            part.write(self, out)

    @classmethod
    def _read(cls, data, at):
        message = cls.__new__(cls)
        counts = {}
        for part in cls._parts:
            at = part.read(message, counts, data, at)
        return message, at

    def __eq__(self, other):
        return type(self) is type(other) and all(getattr(self, n) == getattr(other, n) for n in self.NAMES)

    __hash__ = None

    def __repr__(self):
        return f"{type(self).__name__}({', '.join(f'{n}={getattr(self, n)!r}' for n in self.NAMES)})"


def index_types(*types):
    """Returns a dict of the types by name."""
    return {one.__name__: one for one in types}


class _Numbers:
    """Codec of successive numbers, including counts, and arrays of numbers of fixed size: codes them as one struct."""

    def __init__(self, owner, fields, arrays_of):
        self.owner, self.arrays_of = owner, arrays_of  # counter -> names of its arrays
        self.slots = []  # name, type, number of values (None: one), number of rows (for two dimensions)
        letters = ""
        for name, kind, sizes in fields:
            size = 1
            for one in sizes:
                size *= one
            letters += f"{size}{LETTERS[kind]}" if sizes else LETTERS[kind]
            self.slots.append((name, kind, size if sizes else None, sizes[0] if len(sizes) == 2 else None))
        self.struct = struct.Struct(">" + letters)

    def clear(self, message):
        for name, kind, size, rows in self.slots:
            if name in self.arrays_of:
                continue
            zero = 0.0 if kind in ("double", "float") else 0
            value = zero if size is None else [zero] * size
            setattr(message, name, value if rows is None else [[zero] * (size // rows) for _ in range(rows)])

    def write(self, message, out):
        values = []
        for name, _, size, rows in self.slots:
            if name in self.arrays_of:
                values.append(self._count(message, name))
                continue
            value = getattr(message, name)
            if size is None:
                values.append(value)
                continue
            if rows is not None:
                value = [x for row in value for x in row]
            if len(value) != size:
                raise ValueError(f"{self.owner}.{name} has {len(value)} values, but must have {size}")
            values.extend(value)
        try:
            out.append(self.struct.pack(*values))
        except struct.error:
            raise self._why(values) from None

    def _count(self, message, counter):
        first, *others = self.arrays_of[counter]
        count = len(getattr(message, first))
        for other in others:
            if len(getattr(message, other)) != count:
                raise ValueError(f"{self.owner}.{other} has {len(getattr(message, other))} entries, but {first} has {count}")
        return count

    def _why(self, values):
        at = 0
        for name, kind, size, _ in self.slots:
            for value in values[at:at + (size or 1)]:
                try:
                    struct.pack(">" + LETTERS[kind], value)
                except struct.error as error:
                    return ValueError(f"{self.owner}.{name} is {value!r}, which is not a value of type {kind} ({error})")
            at += size or 1
        return ValueError(f"{self.owner}: the values do not fit")

    def read(self, message, counts, data, at):
        values = self.struct.unpack_from(data, at)
        index = 0
        for name, _, size, rows in self.slots:
            if name in self.arrays_of:
                counts[name] = values[index]
                if values[index] < 0:
                    raise DecodeError(f"{self.owner}.{name} is {values[index]}, but must not be negative")
            elif size is None:
                setattr(message, name, values[index])
            else:
                value = list(values[index:index + size])
                if rows is not None:
                    width = size // rows
                    value = [value[k:k + width] for k in range(0, size, width)]
                setattr(message, name, value)
            index += size or 1
        return at + self.struct.size


class _Text:
    """Codec of a string: its length including NUL, the characters, NUL. Bytes that are not UTF-8, which any program on
    the bus may send, are read as U+FFFD."""

    def __init__(self, owner, name):
        self.owner, self.name = owner, name

    def clear(self, message):
        setattr(message, self.name, "")

    def write(self, message, out):
        text = getattr(message, self.name)
        if not isinstance(text, str) or "\0" in text:
            raise ValueError(f"{self.owner}.{self.name} is {text!r}, but must be text without NUL")
        data = text.encode()
        out.append(_INT.pack(len(data) + 1) + data + b"\0")

    def read(self, message, _counts, data, at):
        (size,) = _INT.unpack_from(data, at)
        at += 4
        text = data[at:at + size] if size > 0 else b""
        if len(text) != size or text.find(b"\0") != size - 1:
            raise DecodeError(f"{self.owner}.{self.name} is not a text of {size} bytes with one NUL, at its end")
        setattr(message, self.name, bytes(text[:-1]).decode("utf-8", "replace"))
        return at + size


class _Bytes:
    """Codec of an array of bytes, whose size is fixed or given by a count."""

    def __init__(self, owner, name, size):
        self.owner, self.name, self.size = owner, name, size

    def clear(self, message):
        setattr(message, self.name, bytes(self.size) if isinstance(self.size, int) else b"")

    def write(self, message, out):
        data = bytes(getattr(message, self.name))
        if isinstance(self.size, int) and len(data) != self.size:
            raise ValueError(f"{self.owner}.{self.name} has {len(data)} bytes, but must have {self.size}")
        out.append(data)

    def read(self, message, counts, data, at):
        size = self.size if isinstance(self.size, int) else counts[self.size]
        value = bytes(data[at:at + size])
        if len(value) != size:
            raise DecodeError(f"{self.owner}.{self.name} needs {size} bytes, but there are {len(value)}")
        setattr(message, self.name, value)
        return at + size


class _Rows:
    """Codec of an array of numbers, or of rows of numbers, whose size a count gives."""

    def __init__(self, owner, name, kind, sizes):
        self.owner, self.name, self.kind, self.count = owner, name, kind, sizes[0]
        self.width = sizes[1] if len(sizes) == 2 else None
        self.letter = LETTERS[kind]
        self.size = struct.calcsize(">" + self.letter)

    def clear(self, message):
        setattr(message, self.name, [])

    def write(self, message, out):
        values = getattr(message, self.name)
        if self.width is not None:
            for row in values:
                if len(row) != self.width:
                    raise ValueError(f"{self.owner}.{self.name} has {len(row)} values in a row, but must have {self.width}")
            values = [x for row in values for x in row]
        try:
            out.append(struct.pack(f">{len(values)}{self.letter}", *values))
        except struct.error as error:
            raise ValueError(f"{self.owner}.{self.name} has a value that is not of type {self.kind} ({error})") from None

    def read(self, message, counts, data, at):
        number = counts[self.count] * (self.width or 1)
        if number * self.size > len(data) - at:
            raise DecodeError(f"{self.owner}.{self.name} needs {number} numbers, more than the bytes hold")
        values = list(struct.unpack_from(f">{number}{self.letter}", data, at))
        if self.width is not None:
            values = [values[k:k + self.width] for k in range(0, number, self.width)]
        setattr(message, self.name, values)
        return at + number * self.size


class _Structs:
    """Codec of a struct inside a message, or of an array of structs whose size a count gives."""

    def __init__(self, owner, name, kind, sizes):
        self.owner, self.name, self.kind = owner, name, kind
        self.count = sizes[0] if sizes else None

    def clear(self, message):
        setattr(message, self.name, self.kind() if self.count is None else [])

    def write(self, message, out):
        value = getattr(message, self.name)
        for one in [value] if self.count is None else value:
            if type(one) is not self.kind:
                raise ValueError(f"{self.owner}.{self.name} must hold {self.kind.__name__}, not {one!r}")
            one._write(out)

    def read(self, message, counts, data, at):
        if self.count is None:
            value, at = self.kind._read(data, at)
        else:
            value = []
            if counts[self.count] > len(data) - at:
                raise DecodeError(f"{self.owner}.{self.name} needs {counts[self.count]} entries, more than the bytes hold")
            for _ in range(counts[self.count]):
                one, at = self.kind._read(data, at)
                value.append(one)
        setattr(message, self.name, value)
        return at


def _parts_of(owner, counters):
    arrays_of = {}
    for name, _, sizes in owner.FIELDS:
        for size in sizes:
            if isinstance(size, str):
                arrays_of.setdefault(size, []).append(name)
    parts, numbers = [], []

    def flush():
        if numbers:
            parts.append(_Numbers(owner.__name__, tuple(numbers), arrays_of))
            numbers.clear()

    for name, kind, sizes in owner.FIELDS:
        is_fixed = all(isinstance(size, int) for size in sizes)
        if kind in LETTERS and is_fixed:
            numbers.append((name, kind, sizes))
            continue
        flush()
        if kind == "string":
            parts.append(_Text(owner.__name__, name))
        elif kind == "byte":
            parts.append(_Bytes(owner.__name__, name, sizes[0]))
        elif kind in LETTERS:
            parts.append(_Rows(owner.__name__, name, kind, sizes))
        else:
            parts.append(_Structs(owner.__name__, name, _known(owner, kind), sizes))
    flush()
    return parts


_TYPES = {}


def _known(owner, kind):
    for base in Message.__subclasses__():
        _TYPES[base.__name__] = base
    if kind not in _TYPES:
        raise TypeError(f"{owner.__name__}: {kind} is not defined before it")
    return _TYPES[kind]
