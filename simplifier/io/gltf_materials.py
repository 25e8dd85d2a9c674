"""What a glTF file says of the material of a primitive, as far as it matters here."""

from __future__ import annotations

from simplifier.io.gltf_json import JsonObject, number_or_nan

_BLENDED = ("BLEND", "MASK")
_TRANSMISSION = "KHR_materials_transmission"


def material_of(root: JsonObject, primitive: JsonObject) -> tuple[str, bool]:
    """Its name, "material 3" where it has none, and whether one sees through it.

    Without a material the name is empty.  One sees through an ``alphaMode`` of BLEND or MASK,
    whatever the colours are, and through a transmission above 0 (KHR_materials_transmission).
    KHR_materials_volume says nothing of it, for it only has an effect with the former; diffuse
    transmission lets light through but no picture.

    Nothing here is worth refusing a mesh for: what is damaged is no material.
    """
    place, materials = primitive.members.get("material"), root.members.get("materials")
    if not isinstance(place, int) or not isinstance(materials, list):
        return "", False
    if not 0 <= place < len(materials) or not isinstance(materials[place], dict):
        return "", False
    material = materials[place]
    name = material.get("name")
    see_through = material.get("alphaMode") in _BLENDED or _transmission(material) > 0.0
    return name if isinstance(name, str) and name else f"material {place}", see_through


def _transmission(material: dict[str, object]) -> float:
    extensions = material.get("extensions")
    found = extensions.get(_TRANSMISSION) if isinstance(extensions, dict) else None
    return number_or_nan(found.get("transmissionFactor")) if isinstance(found, dict) else 0.0
