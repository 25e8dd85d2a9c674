"""Options to be typed, each with its help and, as one types, what is wrong with it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from nicegui import ui
from nicegui.element import Element
from nicegui.elements.mixins.validation_element import ValidationElement
from nicegui.elements.mixins.value_element import ValueElement

from service.dashboard.notices import StandingWarning
from service.dashboard.submit.typed import ReadForm, Typed, read_typed, typed_value
from service.schemas.options import OptionTable
from simplifier import OptionField


class OptionForm:
    """Controls of a table's options.

    ``first``  names of those that most people need; the others are under "More settings".
    ``on_change``  is called whenever a value has changed.
    """

    def __init__(
        self,
        table: OptionTable,
        first: Sequence[str] = (),
        on_change: Callable[[], object] = lambda: None,
    ) -> None:
        self._table, self._on_change = table, on_change
        self._controls: dict[str, ValueElement[Any]] = {}
        self._warning = StandingWarning()
        self._sought: str | None = None  # where to go once "More settings" is unfolded
        fields = {one.name: one for one in table.fields}
        shown = [fields[name] for name in first] if first else list(table.fields)
        self._first = frozenset(one.name for one in shown)
        with ui.element("div").classes("option-grid"):
            for field in shown:
                self._add(field)
        rest = [one for one in table.fields if one not in shown]
        self._more: ui.expansion | None = None
        if rest:
            with ui.expansion("More settings").classes("more-settings") as self._more:
                self._more.props('dense expand-separator header-class="panel-title"')
                self._more.on("after-show", self._go_on)
                with ui.element("div").classes("option-grid"):
                    for field in rest:
                        self._add(field)
        self._fault = ui.label("").classes("fault").props("role=alert")
        self._fault.set_visibility(False)

    @property
    def typed(self) -> dict[str, str]:
        """What stands in the controls."""
        return {name: _text(control.value) for name, control in self._controls.items()}

    def fill(self, typed: Typed) -> None:
        """Put values in, those of options that are not named stay."""
        for name, text in typed.items():
            field = next(one for one in self._table.fields if one.name == name)
            if field.kind == "choice" and text not in field.choices:
                continue
            control = self._controls[name]
            control.value = text == "true" if field.kind == "flag" else text
        self.read()

    def reset(self) -> None:
        """Put the defaults in."""
        self.fill({one.name: typed_value(one, one.default) for one in self._table.fields})

    def read(self) -> ReadForm:
        """Read all of it, and show beside each control what is wrong."""
        form = read_typed(self._table, self.typed)
        for name, control in self._controls.items():
            if isinstance(control, ValidationElement):
                control.error = form.faults.get(name)
        other = [text for name, text in form.faults.items() if not self._shows(name)]
        self._fault.text = " ".join(other)
        self._fault.set_visibility(bool(other))
        if not form.faults:
            self._warning.take_away()
        return form

    def show_faults(self, form: ReadForm) -> None:
        """Say that something is wrong, and go to the first control that is."""
        self._warning.show("Some settings are wrong. See the messages beside them.")
        name = next((name for name in self._controls if name in form.faults), None)
        if name is None:
            _bring_into_sight(self._fault)
        elif name not in self._first and self._more is not None and not self._more.value:
            self._sought = name
            self._more.value = True
        else:
            self._go_to(name)

    def _go_on(self) -> None:
        if self._sought is not None:
            self._go_to(self._sought)
            self._sought = None

    def _go_to(self, name: str) -> None:
        self._controls[name].run_method("focus")
        _bring_into_sight(self._controls[name])  # which Quasar's focus does not

    def _changed(self) -> None:
        self.read()
        self._on_change()

    def _shows(self, name: str) -> bool:
        return isinstance(self._controls.get(name), ValidationElement)

    def _add(self, field: OptionField) -> None:
        with ui.element("div").classes("option"):
            control = _MAKERS.get(field.kind, _typing)(field)
            control.on_value_change(self._changed)
            self._controls[field.name] = control
            if field.kind == "flag":
                ui.label(field.help).classes("option-help").props(f"id=help-{field.name}")
                control.props(f"aria-describedby=help-{field.name}")


def _bring_into_sight(element: Element) -> None:
    # NiceGUI's own number of the element, and no text from outside.
    ui.run_javascript(f"getHtmlElement({element.id}).scrollIntoView({{block: 'center'}})")


def _typing(field: OptionField) -> ui.input:
    # The validation is the form's: an empty one here keeps room for its words.
    control = ui.input(_label(field), value=typed_value(field, field.default), validation={})
    lists = "text" if field.kind in ("lengths", "wholes", "numbers") else "decimal"
    control.props(f"dense outlined inputmode={lists} autocomplete=off spellcheck=false")
    control.props["hint"] = _hint(field)
    if field.absent and len(field.absent) <= _PLACEHOLDER:
        control.props("stack-label").props["placeholder"] = field.absent
    return control.without_auto_validation()


def _choosing(field: OptionField) -> ui.select:
    control = ui.select(list(field.choices), label=_label(field), value=field.default)
    control.props("dense outlined options-dense")
    control.props["hint"] = field.help
    return control


def _ticking(field: OptionField) -> ui.checkbox:
    return ui.checkbox(_label(field), value=field.default).props("dense")


_PLACEHOLDER = 24
"""Letters that the narrowest control has room for; what is longer stands below it."""

_NO_LIMIT = 1e6
"""Nobody types as much."""

_MAKERS: Mapping[str, Callable[[OptionField], ValueElement[Any]]] = {
    "choice": _choosing,
    "flag": _ticking,
}


def _label(field: OptionField) -> str:
    return _LABELS.get(field.name) or field.words[:1].upper() + field.words[1:]


_LABELS = {"lods": "Levels of detail", "fov": "Field of view"}


def _hint(field: OptionField) -> str:
    """The help, the limits where there are some, and what is taken where nothing is typed."""
    hint = _limits_hint(field)
    if len(field.absent) <= _PLACEHOLDER:
        return hint
    return f"{hint} If left empty: {field.absent}."


def _limits_hint(field: OptionField) -> str:
    if field.low is None or field.high is None or field.high >= _NO_LIMIT:
        return field.help
    limits = f"{field.low:,g} to {field.high:,g}"
    if limits in field.help:
        return field.help
    return f"{field.help} {'More than ' if field.low_excluded else ''}{limits}."


def _text(value: object) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    return "" if value is None else str(value)
