"""What displays and players use of the objects behind them, for which others may stand in."""

import ast
import inspect

from voxdisplay.display import display, paced_display, play_show, player, shared_display

MODULES = (display, shared_display, paced_display, play_show, player)


def missing_attributes(stand_ins):
    """Names that `MODULES` use and stand-ins lack; these by the names of variables for them."""
    missing = set()
    for names, stand_in in stand_ins.items():
        used = {name for module in MODULES for name in used_attributes(module, *names)}
        assert used
        missing |= {name for name in used if not hasattr(stand_in, name)}
    return missing


def used_attributes(module, *names):
    """Attributes that a module uses of variables, or of attributes of self, with given names."""
    for node in ast.walk(ast.parse(inspect.getsource(module))):
        if isinstance(node, ast.Attribute):
            value = node.value
            name = getattr(value, "attr", getattr(value, "id", None))
            if name in names:
                yield node.attr
