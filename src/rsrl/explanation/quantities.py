"""How features are named, and how their values are written: with suitable decimals and a readable unit."""

from typing import Final

from rsrl.state import FEATURES, Feature

PACE: Final = ("degradation", "closing", "form", "luck", "pace", "tyre_loss", "wear", "offset", "threshold", "spread")
"""Parts of the names of pace features, in seconds a lap, where hundredths matter."""

PERCENT: Final = ("share", "ratio")
"""Units written as percent."""


def decimals(feature: Feature, value: float) -> int:
    """Decimals of a value: two for a pace, one for other times and for means of counts, none for whole numbers."""
    if feature.unit in ("s", "s/lap"):
        return 2 if any(part in feature.name for part in PACE) else 1
    return 0 if value == round(value) else 1


def bare(feature: Feature, value: float) -> str:
    """A value without its unit: "1.4", "12"; zero has no sign."""
    shown = 100.0 * value if feature.unit in PERCENT else value
    text = f"{shown:.{decimals(feature, shown)}f}"
    return text if text.strip("-0.") else text.lstrip("-")


def quantity(feature: Feature, value: float) -> str:
    """A value with its unit: "1.4 s", "P6", "1 lap", "12 laps", "15.8 %"."""
    return with_unit(bare(feature, value), feature.unit)


def with_unit(number: str, unit: str) -> str:
    """A number as `bare` writes it with a unit of the registry, in the singular for 1."""
    if unit == "place":
        return f"P{number}"
    if unit in PERCENT:
        return f"{number} %"
    one = number.lstrip("-") == "1" and len(unit) > 1 and unit.endswith("s")
    return f"{number} {unit[:-1] if one else unit}".rstrip()


def feature_text(feature: Feature) -> str:
    """What a feature is, in words that stand alone: where the registry says "the same", the text it refers to."""
    if not feature.text.endswith(": the same"):
        return feature.text
    before = FEATURES[: [f.name for f in FEATURES].index(feature.name)]
    head = next(f.text for f in reversed(before) if not f.text.endswith(": the same"))
    call = feature.text.removesuffix(": the same")
    return f"{call}: {head.split(': ', 1)[1]}" if ": " in head else head.replace("boxing for soft", call)
