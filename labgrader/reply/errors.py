"""What an exception means in this task: by its text, and by the arguments that led to it."""

import ast
import contextlib
import difflib
import re
from collections.abc import Callable

import numpy as np

from labgrader.course import course

Explanation = Callable[[re.Match, dict], str]
EXPLAINED: list[tuple[re.Pattern, Explanation]] = []


def explain(text: str, args: dict, line: str = "", program: str = "") -> str:
    """One sentence about an exception, "" if there is none.

    text: "IndexError: index 255 is out of bounds ...". args: the arguments of the call, by their names. line: the
    student's line that raised it, and program: all of the student's, if they are known.

    >>> explain("ZeroDivisionError: division by zero", {"n": 1})
    'Something that you divide by is 0 in this case.'
    """
    for looks, source in ((OF_THE_LINE, line), (OF_THE_PROGRAM, program)):
        for look in looks:
            if says := look(text, source):
                return says
    for pattern, function in EXPLAINED:
        if (found := pattern.match(text)) and (said := function(found, args)):
            return said
    for pattern, says in TABLE.items():
        if found := re.match(pattern, text):
            groups = [found[0], *(group for group in found.groups() if group is not None)]
            return says.format(*groups) if "{" in says else says
    return ""


# ------------------------------------------------------------------------------- by the line that raised it


def expressions_of(line: str) -> list[ast.AST]:
    """The nodes of a line's own expressions; none if it is no statement alone."""
    line = re.sub(r"^(?:el)?(?:if|while)\b(.*):$", r"(\1)", line.strip())
    with contextlib.suppress(SyntaxError, ValueError):
        return list(ast.walk(ast.parse(line)))
    return []


def compared(text: str, line: str) -> str:
    """Comparisons of arrays in a chain, or beside & and | without brackets."""
    if not re.match(r"ValueError: The truth value|TypeError: (?:ufunc 'bitwise|unsupported operand)", text):
        return ""
    bits = ast.BitAnd | ast.BitOr
    chains = [node for node in expressions_of(line) if isinstance(node, ast.Compare) and len(node.ops) > 1]
    inside = [part for node in chains for part in (node.left, *node.comparators)]
    if chains and not any(isinstance(getattr(part, "op", None), bits) for part in inside):
        return "a <= b <= c is for numbers: for arrays, write (a <= b) & (b <= c)."
    unbracketed = re.search(r"[&|]", line) and re.search(r"[<>=!]=|[<>]", line)
    if not unbracketed:
        return ""
    return "& and | bind more tightly than comparisons: put each comparison in brackets, as in (a > 0) & (b > 0)."


def called(text: str, line: str) -> str:
    """A function of the student's that gets too few arguments, or too many."""
    found = re.match(r"TypeError: (?:.*\.)?(\w+)\(\) (missing|takes) (.*)", text)
    if not found or f"{found[1]}(" not in line:
        return ""
    if found[2] == "missing":
        names = " and ".join(re.findall(r"'(\w+)'", found[3])) or "something"
        return f"Your call of {found[1]} lacks {names}: compare it with the line that begins with def {found[1]}."
    return f"Your call of {found[1]} has too many arguments: compare it with the line that begins with def {found[1]}."


def of_one_vector(text: str, line: str) -> str:
    """np.diag and np.outer of arrays that have axes before those of one vector."""
    if not re.search("matmul|broadcast", text) or not (found := re.search(r"np\.(diag|outer)\(", line)):
        return ""
    does = {"diag": "of a matrix takes its diagonal", "outer": "makes one long row of each array"}[found[1]]
    return f"np.{found[1]} {does}: here the vectors are the last axis of arrays that have more. Print their shapes."


def transformed(text: str, line: str) -> str:
    """A 4x4 matrix and points of three numbers."""
    found = re.match(r"ValueError: matmul.*?size (\d+) is different from (\d+)", text)
    if not found or {found[1], found[2]} != {"3", "4"}:
        return ""
    return "A 4x4 transform takes points of four numbers, the last one 1; its rotation T[:3, :3] takes those of three."


def divided_first(text: str, program: str) -> str:
    """An index made of `a // 2 * b`, too large since the product comes after the division."""
    found = re.search(r"//\s*\d+\s*\*\s*\w+", program)
    if not found or not re.match(r"IndexError: index \d.* with size [1-9]", text):
        return ""
    return f"a {found[0]} is (a {found[0].replace(' *', ') *', 1)}: the denominator needs brackets."


def flattened(text: str, program: str) -> str:
    """np.delete without its axis, and an array that has lost its axes."""
    if not re.search(r"diag requires|too many indices|axis \d+ is out of bounds", text):
        return ""
    calls = [node for node in expressions_of(program) if isinstance(node, ast.Call)]
    if any(ast.unparse(node.func) == "np.delete" and len(node.args + node.keywords) == 2 for node in calls):
        return "np.delete without an axis flattens the array first: along which axis do you delete?"
    return ""


def joined(text: str, line: str) -> str:
    """Slices of an array with + between them, as lists are joined."""
    if "broadcast" not in text:
        return ""
    for node in expressions_of(line):
        sides = (node.left, node.right) if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add) else ()
        if sides and all(isinstance(getattr(side, "slice", None), ast.Slice) for side in sides):
            return "+ concatenates lists. With arrays it adds the numbers, entry by entry: use np.concatenate."
    return ""


def nothing_to_average(text: str, line: str) -> str:
    """int() of the mean of nothing."""
    if not text.startswith("ValueError: cannot convert float NaN") or "mean(" not in line:
        return ""
    return "The mean of nothing is NaN, not an integer: what selects nothing in this case, and is it asked for?"


def counted(text: str, line: str) -> str:
    """Counts of unlike length."""
    if "bincount" not in line or "same shape" not in text:
        return ""
    return "np.bincount counts up to the largest number, so 256 with a 255 in it: leave those out before you count."


OF_THE_LINE = (compared, called, of_one_vector, transformed, joined, nothing_to_average, counted)
OF_THE_PROGRAM = (divided_first, flattened)

# ---------------------------------------------------------------------------------------- by the exception's text


def when(pattern: str) -> Callable[[Explanation], Explanation]:
    """Enter an explanation of exceptions whose text begins so."""

    def enter(function: Explanation) -> Explanation:
        EXPLAINED.append((re.compile(pattern), function))
        return function

    return enter


def arrays(args: dict) -> dict[str, np.ndarray]:
    """The arguments that are arrays."""
    return {name: value for name, value in args.items() if isinstance(value, np.ndarray)}


@when(r"IndexError: index (-?\d+) is out of bounds for axis (\d+) with size (\d+)")
def outside(found: re.Match, args: dict) -> str:
    """An index beyond the end: an ignored label, one too many, or an argument's value."""
    index, axis, size = map(int, found.groups())
    if size == 0:
        return f"You take entry {index} of an array that has none: which slice, or which mask, selects nothing here?"
    holding = [name for name, a in arrays(args).items() if a.dtype.kind in "iu" and (a == index).any()]
    if index == course().ignored and holding:
        return f"The ignored pixels of {holding[0]}, labelled {index}, are used as an index: leave them out first."
    if index < 0:
        return f"The index {index} counts from the end, and axis {axis} has length {size}."
    if index == size:
        of = " and ".join(name for name, a in arrays(args).items() if a.ndim > axis and a.shape[axis] == size)
        along = f"axis {axis}{' (as long as that of ' + of + ')' if of else ''}"
        return f"The index {index} is one past the end: the last one along {along} is {size - 1}."
    others = [
        (f"axis {k} of {name}", n) for name, a in arrays(args).items() for k, n in enumerate(a.shape) if k != axis
    ]
    lengths = [which for which, n in others if index < n]
    if lengths:
        return f"Axis {axis} has length {size}; an index up to {index} fits {lengths[0]}: are two axes swapped?"
    return f"An index of {index} into an axis of {size}: what does the index count, and what does this array hold?"


@when(r"ValueError: operands could not be broadcast together with shapes? \(([\d,]*)\) \(([\d,]*)\)")
@when(r"ValueError: operands could not be broadcast together with remapped shapes.*?: \(([\d,]*)\).*? \(([\d,]*)\)->")
def shapes_do_not_fit(found: re.Match, args: dict) -> str:
    """Two shapes that do not fit, named by the arguments that have them."""
    a, b = (tuple(int(n) for n in text.split(",") if n) for text in found.groups())
    said = " and ".join(f"{shape}{whose(shape, args)}" for shape in (a, b))
    masked = [(one, other) for one, other in ((a, b), (b, a)) if len(one) == 1 < len(other) and whose(other, args)]
    if masked and masked[0][0][0] not in masked[0][1] and masked[0][0][0] <= np.prod(masked[0][1]):
        (count,), other = masked[0]
        made, again = "perhaps what a mask left", "mask"
        if count == np.prod(other):
            made, again = "as a mask or ravel puts them in a row", "treat"
        return f"{count} numbers, {made}, meet shape {other}{whose(other, args)}: {again} both alike."
    if len(a) != len(b):
        return f"Shapes {said} do not fit: is an axis missing, as [..., None] or keepdims=True gives it?"
    if sorted(a) == sorted(b):
        return f"Shapes {said} have the same lengths in another order: which one has its axes swapped?"
    unlike = [(m, n) for m, n in zip(a, b, strict=True) if m != n and 1 not in (m, n)]
    m, n = unlike[0] if unlike else (a[0], b[0])
    return f"Shapes {said} do not fit: one has length {m} where the other has {n}. Which of the two did you expect?"


def whose(shape: tuple[int, ...], args: dict) -> str:
    """Whose shape it is, in brackets."""
    names = [name for name, a in arrays(args).items() if a.shape == shape]
    return f" (the shape of {' and '.join(names)})" if names else ""


@when(r"ValueError: non-broadcastable output .*? \(([\d,]*)\) doesn't match the broadcast shape \(([\d,]*)\)")
def written_in_place(found: re.Match, args: dict) -> str:
    """Something of one shape put into a place of another, as by |= or +=."""
    place, put = (tuple(int(n) for n in text.split(",") if n) for text in found.groups())
    if (0 in place) != (0 in put):
        which = "The left" if 0 in place else "The right"
        return f"{which} side is empty here: does a slice end before it begins? A bound below 0 counts from the end."
    return f"The place on the left has shape {place}, and what you put there makes it {put}. Print both sides' shapes."


@when(r"ValueError: cannot reshape array of size (\d+) into shape \(([\w,-]*)\)")
def another_size(found: re.Match, args: dict) -> str:
    """A reshape to a shape of another size, perhaps of twice as many numbers."""
    size, lengths = int(found[1]), [-1 if n in ("newaxis", "-1") else int(n) for n in found[2].split(",") if n]
    fits, shape = abs(int(np.prod(lengths))), ",".join(map(str, lengths))
    if -1 in lengths:
        asks = f"a multiple of {fits}: which length is wrong, or is padding left in?"
    elif size and fits % size == 0:
        asks = f"{fits}: is a length {fits // size} times too large, or are numbers missing?"
    elif fits and size % fits == 0:
        asks = f"{fits}: is a length {size // fits} times too small, or is padding left in?"
    else:
        asks = f"{fits}: are there too many (padding, perhaps), or are some missing?"
    return f"{size} numbers do not fill the shape ({shape}), which takes {asks}"


@when(r"(?:(?:numpy\.exceptions\.)?AxisError|an exception): axis (-?\d+) is out of bounds for array of dimension (\d+)")
def no_such_axis(found: re.Match, args: dict) -> str:
    """An axis that there is not."""
    count = int(found[2])
    if count == 0:
        return f"There is no axis {found[1]} here: it is one number, and no array."
    axes = "one axis, number 0" if count == 1 else f"{count} axes, 0 to {count - 1}"
    return f"There is no axis {found[1]} here: in this case the array has {axes}. The last axis is always number -1."


@when(r"TypeError: .+?\(\) (?:takes|missing).*positional")
def signature(found: re.Match, args: dict) -> str:
    """Another number of arguments than the check gives."""
    return f"The check calls it with these arguments: {', '.join(args)}. Keep the first line of the cell as it is."


@when(r"NameError: name '(\w+)' is not defined")
def no_such_name(found: re.Match, args: dict) -> str:
    """A name that nobody defined."""
    if found[1] in ("np", "numpy"):
        return "NumPy is not imported: run the cell with `import numpy as np` at the top of the lab."
    near = difflib.get_close_matches(found[1], [*args, "np"], 1, 0.7)
    if near:
        return f"No cell defines {found[1]}: do you mean {near[0]}?"
    return f"No cell that counts here defines {found[1]}: is it spelled right, and was its cell run?"


@when(r"AttributeError: module 'numpy(?:\.\w+)?' has no attribute '(\w+)'")
def no_such_function(found: re.Match, args: dict) -> str:
    """A function that NumPy does not have."""
    near = difflib.get_close_matches(found[1], dir(np), 1, 0.6)
    return f"NumPy has no {found[1]}" + (f": do you mean np.{near[0]}?" if near else ".")


@when(r"AttributeError: '(?:\w+\.)*(\w+)' object has no attribute '(\w+)'")
def no_such_attribute(found: re.Match, args: dict) -> str:
    """An attribute that an object does not have."""
    if found[1] == "NoneType":
        return "Something is None there: a function without `return`, or one that works in place, gives None."
    near = difflib.get_close_matches(found[2], dir(np.ndarray), 1, 0.6) if found[1] == "ndarray" else []
    article = "An" if found[1] == "ndarray" or found[1][0].lower() in "aeio" else "A"
    asks = f"do you mean .{near[0]}?" if near else "is it what you think it is?"
    return f"{article} {found[1]} has no {found[2]}: {asks}"


# Exceptions that one sentence explains; {1} is what the first bracket of the pattern holds.
TABLE = {
    r"EOFError: EOF when reading": "input() waits for somebody to type, and nobody does: all that you need is passed.",
    r"IndexError: (?:arrays used as indices|only integers|.*is not a valid index)|TypeError: \w+ indices must be": (
        "An index must be integers or booleans: is it the right one? If so, use .astype(int), or a comparison."
    ),
    r"IndexError: boolean index did not match .*?axis (\d+); .*?is (\d+) but .*?is (\d+)": (
        "A mask of length {3} along axis {1} selects from an array of length {2}: whose mask is it?"
    ),
    r"IndexError: too many indices.*?(\d+)-dimensional, but (\d+)": (
        "{2} indices for an array with {1} axes: which argument has how many axes? Print its shape."
    ),
    r"IndexError: invalid index to scalar|TypeError: .*object is not subscriptable": (
        "You take an entry of something that is a single number: does a sum lack its axis?"
    ),
    r"IndexError: (?:list|tuple|string)(?: assignment)? index out of range": (
        "The list is shorter than you think in this case: how long is it, and where does the index start?"
    ),
    r"ValueError: matmul.*?size (\d+) is different from (\d+)": (
        "In a product A @ B, A must have as many columns ({2}) as B has rows ({1}). Print both "
        "shapes: does one have other axes than you meant, a .T too many, or one too few?"
    ),
    r"ValueError: shapes \(([\d,]*)\) and \(([\d,]*)\) not aligned": (
        "Shapes ({1}) and ({2}) cannot be multiplied: the first's columns do not match the second's rows."
    ),
    r"ValueError: could not broadcast input array from shape \(([\d,]*)\) into shape \(([\d,]*)\)": (
        "You put something of shape ({1}) into a place of shape ({2})."
    ),
    r"(?:Value|Index)Error: (?:shape mismatch|could not be broadcast|.*shape mismatch)": (
        "Index arrays are paired entry by entry, so their shapes must fit: print them. To pair each row "
        "with each column, give one of them an extra axis, as in rows[:, None]."
    ),
    r"ValueError: need at least one array": "In this case there is nothing to stack or concatenate: is a list empty?",
    r"ValueError: all the input array|ValueError: all input arrays": (
        "Arrays that are stacked or concatenated must agree in all other axes: print the shape of each."
    ),
    r"ValueError: The truth value of an array|ValueError: The truth value of a": (
        "`if`, `and`, `or`, `min` and `max` take one truth value, not an array: is a sum missing? For arrays there are "
        "np.where, &, | and np.minimum."
    ),
    r"ValueError: (?:'?axes?'?.*match|axes don't match|repeated axis|duplicate value in 'axis')": (
        "The list of axes must name each axis of the array once."
    ),
    r"ValueError: zero-size array to reduction operation (\w+)|ValueError: attempt to get (\w+) of an empty|"
    r"ValueError: (\w+)\(\) (?:arg is an empty sequence|iterable argument is empty)": (
        "{1} gets an empty array: is an input empty, does a mask select nothing, or does an index run too far?"
    ),
    r"ValueError: zip\(\) argument (\d+) is (\w+) than": (
        "Of the lists that you loop over together, number {1} is {2} than those before: print them."
    ),
    r"ValueError: array is not broadcastable": "What you add has another shape than the places it goes to: print both.",
    r"ValueError: The weights and list don't have the same length": (
        "np.bincount needs one weight for each number it counts, in the same order: print both."
    ),
    r"ValueError: kth\(=(-?\d+)\) out of bounds \((\d+)\)": "There are only {2} numbers, and you ask for number {1}.",
    r"ValueError: slice step cannot be zero": "The step of a slice is 0 in this case: which number should it be?",
    r"ValueError: .*(?:enough dimensions|too small depth)": (
        "A function gets one number where it expects a vector or a matrix: was a sum, or an index, taken too early?"
    ),
    r"ValueError: .*(?:too many subscripts|too deep|must be 1 dimensional|mismatch in its core)": (
        "A function gets an array of another shape than it expects: print the shape of each of its arguments."
    ),
    r"ValueError: index can't contain negative": "A width, length or index is below 0: which difference is it?",
    r"ValueError: strides is incompatible|ValueError: buffer is smaller": (
        "The buffer holds fewer bytes than the shape and the strides need: which of them is too large?"
    ),
    r"ValueError: (?:not enough|too many) values to unpack": (
        "The number of names on the left differs from the number of values on the right: print what is on the right."
    ),
    r"ValueError: (?:setting an array element|.*inhomogeneous)": (
        "The parts of the array have different lengths. Print each of them: which one is longer or shorter than you "
        "meant?"
    ),
    r"ZeroDivisionError": "Something that you divide by is 0 in this case.",
    r"OverflowError: Python integer (-?\d+) out of bounds for (\w+)": (
        "{1} does not fit into {2}: convert the array first, with .astype(int) or .astype(float)."
    ),
    r"OverflowError|FloatingPointError": "A number grows too large: which exponential, power or cast is it?",
    r"(?:(?:numpy\.linalg\.)?LinAlgError|an exception): Singular matrix": (
        "This matrix has no inverse: is it the one you mean, and are all its rows filled?"
    ),
    r"(?:numpy\.linalg\.)?LinAlgError": "np.linalg expects square matrices of finite numbers, in the last two axes.",
    r".*?: Cannot cast (?:ufunc '\w+' output|array data) from dtype\('(\w+)'\) to dtype\('(\w+)'\)": (
        "An array of {2} cannot hold {1} in place: write x = x + ..., or use x.astype(float) first."
    ),
    r"TypeError: (?:unsupported operand type|bad operand type).*?'NoneType'": (
        "One of the operands is None: a function without `return`, or one that works in place, gives None."
    ),
    r"TypeError: (?:unsupported operand type|can only concatenate).*?(list|tuple)": (
        "You calculate with a {1}: for Python, + concatenates lists and * repeats them. Make it an array first."
    ),
    r"TypeError: numpy boolean (?:subtract|negative)|TypeError: The numpy boolean (?:negative|subtract)": (
        "Booleans have no minus: use ~ for not, ^ for different, or .astype(int)."
    ),
    r"TypeError: ufunc '(\w+)' not supported|TypeError: unsupported operand type\(s\) for ([&|^~]+)": (
        "&, |, ^ and ~ work on booleans and integers: compare first, in brackets, as in (a > 0) & (b > 0)."
    ),
    r"TypeError: only (?:length-1|0-dimensional|integer scalar|size-1) arrays": (
        "Python expects one number there and gets an array: is a sum or an index missing, or np.exp for math.exp?"
    ),
    r"TypeError: (?:int|float)\(\) argument must be .*'NoneType'": (
        "Something is still None there: in this case nothing has given it a value. Which condition was never true?"
    ),
    r"TypeError: (?:int|float)\(\) argument must be|TypeError: must be real number, not": (
        "Python expects one number there and gets a list or a tuple: which of its entries do you mean?"
    ),
    r"TypeError: 'numpy\.ndarray' object is not callable|TypeError: '(\w+)' object is not callable": (
        "Round brackets call a function; square brackets take entries. Or has a variable taken a function's name?"
    ),
    r"TypeError: '(?:numpy\.)?\w+' object is not iterable|TypeError: Value after \* must be an iterable": (
        "You loop over a single number: is it the length, where `range` or the array itself is meant?"
    ),
    r"ValueError: invalid literal for int|ValueError: cannot convert float NaN": (
        "An integer cannot be NaN or infinite: is float() meant? An array of integers needs .astype(float) first."
    ),
    r"TypeError: '(\w+)' object does not support item assignment": (
        "You assign to an entry of a {1}, which cannot be changed: was an array meant?"
    ),
    r"TypeError: (.+?)\(\) got an unexpected keyword argument '(\w+)'": (
        "{1} has no option {2}: look it up with `{1}?`."
    ),
    r"TypeError: (?:'\w+' object cannot be interpreted as an int|expected a sequence of int|slice indices must be)": (
        "A length, bound or axis must be an integer: / gives a float, // an integer; np.max(a, b) takes b for an axis."
    ),
    r"TypeError: return arrays must be of ArrayType": (
        "Too many arguments: np.max and np.min take one array, as in np.max([a, b, c]), np.maximum and np.minimum two."
    ),
    r"TypeError: data type '(.*)' not understood": "There is no dtype {1}: are a field's name and its type swapped?",
    r"TypeError: .*?expected at most (\d+) arguments?, got (\d+)": (
        "A function gets {2} arguments and takes {1}: look it up."
    ),
    r"UnboundLocalError: cannot access local variable '(\w+)'": (
        "{1} is read before it gets a value: in this case no branch, and no iteration of the loop, sets it."
    ),
    r"KeyError": "The dictionary has no such key in this case: which values can occur?",
    r"RecursionError": "It calls itself about a thousand times: does it stop in this case, and after how many calls?",
    r"MemoryError|numpy\._core\._exceptions\._ArrayMemoryError|_ArrayMemoryError": (
        "An array of that size does not fit into memory: which length is wrong?"
    ),
    r"ValueError: negative dimensions|ValueError: negative shift count|ValueError: array is too big": (
        "A length comes out negative or huge: which subtraction, or which byte order, is the wrong way round?"
    ),
}
