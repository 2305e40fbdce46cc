"""What an exception means in this task: by its text, and by the arguments that led to it."""

import difflib
import re
from collections.abc import Callable

import numpy as np

Explanation = Callable[[re.Match, dict], str]
EXPLAINED: list[tuple[re.Pattern, Explanation]] = []


def explain(text: str, args: dict) -> str:
    """One sentence about an exception, "" if there is none.

    text: "IndexError: index 255 is out of bounds ...". args: the arguments of the call, by their names.

    >>> explain("ZeroDivisionError: division by zero", {"n": 1})
    'Something that you divide by is 0 in this case.'
    """
    for pattern, function in EXPLAINED:
        if (found := pattern.match(text)) and (said := function(found, args)):
            return said
    return ""


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
    holding = [name for name, a in arrays(args).items() if a.dtype.kind in "iu" and (a == index).any()]
    if index == 255 and holding:
        return f"The ignored pixels of {holding[0]}, labelled 255, are used as an index: leave them out before."
    if index < 0:
        return f"The index {index} counts from the end, and there are only {size} entries along axis {axis}."
    if index == size:
        return f"The index {index} is one past the end: the last one along axis {axis} is {size - 1}."
    lengths = [f"axis {k} of {name}" for name, a in arrays(args).items() for k, n in enumerate(a.shape) if index < n]
    if holding:
        return f"A value of {holding[0]}, {index}, is used as an index into an axis of only {size}."
    if lengths:
        return f"Axis {axis} has only {size} entries; an index up to {index} fits {lengths[0]}: are two axes exchanged?"
    return f"An index of {index} into an axis of {size}: which numbers can stand there?"


@when(r"IndexError: (?:arrays used as indices|only integers|.*is not a valid index)")
def no_index(found: re.Match, args: dict) -> str:
    """Floats as indices."""
    return "An index must be whole numbers or truth values: convert it with .astype(int), or compare."


@when(r"IndexError: boolean index did not match .*?axis (\d+); .*?is (\d+) but .*?is (\d+)")
def mask_does_not_fit(found: re.Match, args: dict) -> str:
    """A mask of another shape."""
    return f"A mask of {found[3]} entries along axis {found[1]} selects from an array of {found[2]}: whose mask is it?"


@when(r"IndexError: too many indices.*?(\d+)-dimensional, but (\d+)")
def too_many_indices(found: re.Match, args: dict) -> str:
    """More indices than axes."""
    return f"{found[2]} indices for an array of {found[1]} axes: which argument has how many axes? Print its shape."


@when(r"IndexError: invalid index to scalar|TypeError: .*object is not subscriptable")
def index_into_a_number(found: re.Match, args: dict) -> str:
    """An index into a number."""
    return "You take an entry of something that is a single number: does a sum lack its axis?"


@when(r"IndexError: (?:list|tuple|string) index out of range")
def past_the_list(found: re.Match, args: dict) -> str:
    """An index beyond a list's end."""
    return "The list is shorter than you think in this case: how long is it, and where does the index start?"


@when(r"ValueError: operands could not be broadcast together with shapes? \(([\d,]*)\) \(([\d,]*)\)")
def shapes_do_not_fit(found: re.Match, args: dict) -> str:
    """Two shapes that do not fit, named by the arguments that have them."""
    a, b = (tuple(int(n) for n in text.split(",") if n) for text in found.groups())
    said = " and ".join(f"{shape}{whose(shape, args)}" for shape in (a, b))
    if len(a) != len(b):
        return f"Shapes {said} do not fit: is an axis missing, as [..., None] or keepdims=True gives it?"
    if sorted(a) == sorted(b):
        return f"Shapes {said} are each other's transpose: which one has its axes exchanged?"
    return f"Shapes {said} do not fit, number by number: which of them should be another?"


def whose(shape: tuple[int, ...], args: dict) -> str:
    """Whose shape it is, in brackets."""
    names = [name for name, a in arrays(args).items() if a.shape == shape]
    return f" (the shape of {' and '.join(names)})" if names else ""


@when(r"ValueError: matmul.*?size (\d+) is different from (\d+)")
def product_does_not_fit(found: re.Match, args: dict) -> str:
    """A matrix product of shapes that do not fit."""
    fit = f"In a product A @ B the columns of A ({found[2]}) must be as many as the rows of B ({found[1]})."
    return f"{fit} Points that are rows are multiplied from the left: P @ R.T."


@when(r"ValueError: shapes \(([\d,]*)\) and \(([\d,]*)\) not aligned")
def dot_does_not_fit(found: re.Match, args: dict) -> str:
    """The same for np.dot."""
    return (
        f"Shapes ({found[1]}) and ({found[2]}) have no product: the first has other columns than the second has rows."
    )


@when(r"ValueError: could not broadcast input array from shape \(([\d,]*)\) into shape \(([\d,]*)\)")
def does_not_fit_in(found: re.Match, args: dict) -> str:
    """An assignment of another shape."""
    return f"You put something of shape ({found[1]}) into a place of shape ({found[2]})."


@when(r"ValueError: (?:shape mismatch|could not be broadcast|.*shape mismatch)")
def indices_do_not_fit(found: re.Match, args: dict) -> str:
    """Index arrays of different shapes."""
    return "Index arrays that are used together must have one shape: print the shape of each."


@when(r"ValueError: all the input array|ValueError: need at least one array|ValueError: all input arrays")
def cannot_stack(found: re.Match, args: dict) -> str:
    """Arrays of different shapes stacked."""
    return "Arrays that are stacked or joined must agree in all other axes: print the shape of each."


@when(r"ValueError: cannot reshape array of size (\d+) into shape \(([\d,-]*)\)")
def does_not_reshape(found: re.Match, args: dict) -> str:
    """A reshape to another size."""
    return f"{found[1]} numbers do not fill the shape ({found[2]}): is there padding that does not belong to it?"


@when(r"ValueError: The truth value of an array|ValueError: The truth value of a")
def truth_of_an_array(found: re.Match, args: dict) -> str:
    """if, and, or, max of arrays."""
    return "`if`, `and`, `or`, `min` and `max` take one truth value, not an array: use np.where, &, | or np.minimum."


@when(r"(?:numpy\.exceptions\.)?AxisError: axis (-?\d+) is out of bounds for array of dimension (\d+)")
def no_such_axis(found: re.Match, args: dict) -> str:
    """An axis that there is not."""
    by_hand = f"{found[2]} axes: 0" + (f" to {int(found[2]) - 1}" if int(found[2]) > 1 else "")
    return (
        f"There is no axis {found[1]} here: the array has {by_hand if found[2] != '0' else 'none, it is one number'}."
    )


@when(r"ValueError: '?axes?'?.*match|ValueError: axes don't match")
def axes_do_not_match(found: re.Match, args: dict) -> str:
    """Transposing with another number of axes."""
    return "The list of axes must name each axis of the array once."


@when(r"ValueError: zero-size array to reduction operation (\w+)")
def nothing_to_reduce(found: re.Match, args: dict) -> str:
    """min or max of nothing."""
    return f"The {found[1]} of nothing: in this case nothing is left. What is right then?"


@when(r"ValueError: (?:not enough|too many) values to unpack")
def unpacked(found: re.Match, args: dict) -> str:
    """Another number of values."""
    return "The left side names another number of values than there are on the right: print what stands there."


@when(r"ValueError: (?:setting an array element|.*inhomogeneous)")
def ragged(found: re.Match, args: dict) -> str:
    """A list of unlike lengths."""
    return "The parts of the array have different lengths: which of them is a list or an array by mistake?"


@when(r"ZeroDivisionError")
def divided_by_zero(found: re.Match, args: dict) -> str:
    """Python's own division by zero."""
    return "Something that you divide by is 0 in this case."


@when(r"OverflowError|FloatingPointError")
def overflow(found: re.Match, args: dict) -> str:
    """A number that is too large."""
    return "A number grows too large: which exponential, power or cast is it?"


@when(r"(?:numpy\.linalg\.)?LinAlgError: Singular matrix")
def singular(found: re.Match, args: dict) -> str:
    """A matrix that has no inverse."""
    return "This matrix has no inverse: is it the one that you mean, and are all its rows filled?"


@when(r"(?:numpy\.linalg\.)?LinAlgError")
def linear_algebra(found: re.Match, args: dict) -> str:
    """Other complaints of linear algebra."""
    return "np.linalg wants square matrices of finite numbers, in the last two axes."


@when(r".*?: Cannot cast ufunc '(\w+)' output from dtype\('(\w+)'\) to dtype\('(\w+)'\)")
def in_place_cast(found: re.Match, args: dict) -> str:
    """In-place arithmetic on whole numbers."""
    return f"An array of {found[3]} cannot hold {found[2]} in place: write x = x + ..., or x.astype(float) before."


@when(r"TypeError: (?:unsupported operand type|bad operand type).*?'NoneType'")
def none_in_arithmetic(found: re.Match, args: dict) -> str:
    """None in arithmetic."""
    return "One of the operands is None: a function without `return`, or one that works in place, gives None."


@when(r"TypeError: numpy boolean (subtract|negative)|TypeError: The numpy boolean (negative|subtract)")
def boolean_arithmetic(found: re.Match, args: dict) -> str:
    """Minus of truth values."""
    return "Truth values have no minus: use ~ for not, ^ for different, or .astype(int)."


@when(r"TypeError: ufunc '(\w+)' not supported|TypeError: unsupported operand type\(s\) for ([&|^~]+)")
def wrong_types(found: re.Match, args: dict) -> str:
    """&, |, ~ of floats."""
    return "&, |, ^ and ~ work on truth values and whole numbers: compare first, in brackets, as in (a > 0) & (b > 0)."


@when(r"TypeError: only (?:length-1|0-dimensional|integer scalar|size-1) arrays")
def array_for_a_number(found: re.Match, args: dict) -> str:
    """An array where Python wants one number."""
    return (
        "Python wants one number there and gets an array: use NumPy's function, np.exp for math.exp, or take one entry."
    )


@when(r"TypeError: 'numpy\.ndarray' object is not callable|TypeError: '(\w+)' object is not callable")
def not_a_function(found: re.Match, args: dict) -> str:
    """Round brackets after something that is no function."""
    return (
        "Round brackets call a function; entries are taken with square ones. Or has a variable taken a function's name?"
    )


@when(r"TypeError: .+?\(\) (?:takes|missing).*positional")
def signature(found: re.Match, args: dict) -> str:
    """Another number of arguments than the check gives."""
    return f"The check calls it with these arguments: {', '.join(args)}. Keep the first line of the cell as it is."


@when(r"TypeError: (.+?)\(\) got an unexpected keyword argument '(\w+)'")
def unknown_keyword(found: re.Match, args: dict) -> str:
    """A keyword that a function does not know."""
    return f"{found[1]} has no option {found[2]}: look it up with `{found[1]}?`."


@when(r"TypeError: (?:'\w+' object cannot be interpreted as an int|expected a sequence of int|slice indices must be)")
def wants_an_integer(found: re.Match, args: dict) -> str:
    """A float where a whole number belongs."""
    return "A length or a bound must be a whole number: / gives a float, // a whole number."


@when(r"NameError: name '(\w+)' is not defined")
def no_such_name(found: re.Match, args: dict) -> str:
    """A name that nobody defined."""
    near = difflib.get_close_matches(found[1], [*args, "np"], 1, 0.7)
    return (
        f"No cell defines {found[1]}: do you mean {near[0]}?"
        if near
        else (f"No cell that counts here defines {found[1]}: is it spelled right, and was its cell run?")
    )


@when(r"UnboundLocalError: cannot access local variable '(\w+)'")
def unbound(found: re.Match, args: dict) -> str:
    """A local name read before it has a value."""
    return f"{found[1]} is read before it gets a value: in this case no branch, or no turn of the loop, sets it."


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
    return f"An {found[1]} has no {found[2]}" + (
        f": do you mean .{near[0]}?" if near else ": is it what you think it is?"
    )


@when(r"KeyError")
def no_such_key(found: re.Match, args: dict) -> str:
    """A key that is not in a dictionary."""
    return "The dictionary has no such key in this case: which values can occur?"


@when(r"RecursionError")
def endless_recursion(found: re.Match, args: dict) -> str:
    """A function that calls itself without end."""
    return "It calls itself without end: in which case does it stop?"


@when(r"MemoryError|numpy\._core\._exceptions\._ArrayMemoryError|_ArrayMemoryError")
def too_large(found: re.Match, args: dict) -> str:
    """An array that is too large."""
    return "An array of that size does not fit into memory: which length is wrong?"


@when(r"ValueError: negative dimensions|ValueError: negative shift count|ValueError: array is too big")
def negative_length(found: re.Match, args: dict) -> str:
    """A length below 0."""
    return "A length comes out negative or huge: which subtraction, or which byte order, is the wrong way round?"
