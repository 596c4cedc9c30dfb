"""The planning habits are data that the catalogue can satisfy, and every object of a layout has a reason."""

from labgym.assets import Catalog
from labgym.layouts import generate, reasons, resolve_request
from labgym.layouts.habits import Habits
from labgym.layouts.rules.storage import STORAGE_CLASSES
from labgym.protocols import protocols


def test_every_asset_that_the_habits_name_exists_and_stands_where_they_say():
    habits, catalog = Habits.published(), Catalog.published()
    furniture = [*habits.habits, *habits.always, *habits.filling, habits.peninsula]
    furniture += [piece.asset for piece in habits.furniture] + [pair.first for pair in habits.near]
    furniture += [pair.second for pair in habits.near] + [cabinet.asset for cabinet in habits.cabinets.values()]
    furniture += [*habits.homes.values(), habits.default_home]
    assert all(catalog.get(name).placing == "floor" for name in furniture)
    dressing = habits.dressing
    hung = [accessory for each in dressing.rooms.values() for accessory in each]
    assert all(catalog.get(accessory.asset).placing == "wall" for accessory in hung)
    assert all(accessory.near in ("door", "hood") or accessory.near in catalog for accessory in hung)
    assert all(catalog.get(accessory.asset).placing == "floor" for accessory in dressing.floor)
    assert all(catalog.get(name).surfaces for name in (*dressing.surfaces, *dressing.shelves))
    accessories = [name for names in (*dressing.surfaces.values(), *dressing.shelves.values()) for name in names]
    assert all(catalog.get(name).heat_class in (None, "instrument") for name in (*accessories, *dressing.islands))


def test_every_storage_class_of_reagents_has_a_cabinet_of_that_class():
    habits, catalog = Habits.published(), Catalog.published()
    assert set(habits.cabinets) == STORAGE_CLASSES
    for storage, cabinet in habits.cabinets.items():
        assert catalog.get(cabinet.asset).storage_class == storage


def test_every_object_that_a_protocol_brings_has_a_reason():
    layout, why = generate("alk_03", 5), reasons(resolve_request("alk_03", 5))
    assert all(why.values())
    assert set(why) <= set(layout.by_id)
    protocol, catalog = protocols()["alk_03"], Catalog.load()
    required = {catalog.find(name).name for name in protocol.required_assets()}
    assert required <= {layout.placement(placement).asset for placement in why}
    assert why["FumeHood_1"].startswith("location of step")
    cabinets = [placement for placement in why if layout.asset(placement).storage_class in STORAGE_CLASSES]
    assert cabinets
    for cabinet in cabinets:
        assert all(child.asset in why[cabinet] for child in layout.children(cabinet))
