"""The messages of the Open Reaction Database that an experiment needs.

Field numbers and names are those of ord-schema 0.9, so its binary, text and JSON files parse; other fields are ignored.
The package ord-schema requires an older protobuf than the layout solver, so the two cannot be installed together.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from labgym.errors import optional_package

_ENUMS: dict[str, str] = {
    "ReactionIdentifierType": "UNSPECIFIED CUSTOM REACTION_SMILES RDFILE RINCHI REACTION_TYPE REACTION_CXSMILES",
    "CompoundIdentifierType": "UNSPECIFIED CUSTOM SMILES INCHI MOLBLOCK IUPAC_NAME NAME CAS_NUMBER PUBCHEM_CID "
    "CHEMSPIDER_ID CXSMILES INCHI_KEY XYZ UNIPROT_ID PDB_ID AMINO_ACID_SEQUENCE HELM MDL",
    "MassUnit": "UNSPECIFIED KILOGRAM GRAM MILLIGRAM MICROGRAM",
    "MolesUnit": "UNSPECIFIED MOLE MILLIMOLE MICROMOLE NANOMOLE",
    "VolumeUnit": "UNSPECIFIED LITER MILLILITER MICROLITER NANOLITER",
    "TimeUnit": "UNSPECIFIED HOUR MINUTE SECOND DAY",
    "TemperatureUnit": "UNSPECIFIED CELSIUS FAHRENHEIT KELVIN",
    "PressureUnit": "UNSPECIFIED BAR ATMOSPHERE PSI KPSI PASCAL KILOPASCAL TORR MM_HG",
    "ReactionRoleType": "UNSPECIFIED REACTANT REAGENT SOLVENT CATALYST WORKUP INTERNAL_STANDARD AUTHENTIC_STANDARD "
    "PRODUCT BYPRODUCT SIDE_PRODUCT",
    "AdditionSpeedType": "UNSPECIFIED ALL_AT_ONCE FAST SLOW DROPWISE CONTINUOUS PORTIONWISE",
    "TemperatureControlType": "UNSPECIFIED CUSTOM AMBIENT OIL_BATH WATER_BATH SAND_BATH ICE_BATH DRY_ALUMINUM_PLATE "
    "MICROWAVE DRY_ICE_BATH AIR_FAN LIQUID_NITROGEN",
    "AtmosphereType": "UNSPECIFIED CUSTOM AIR NITROGEN ARGON OXYGEN HYDROGEN CARBON_MONOXIDE CARBON_DIOXIDE METHANE "
    "AMMONIA OZONE ETHYLENE ACETYLENE",
    "StirringMethodType": "UNSPECIFIED CUSTOM NONE STIR_BAR OVERHEAD_MIXER AGITATION BALL_MILLING SONICATION",
    "IlluminationType": "UNSPECIFIED CUSTOM AMBIENT DARK LED HALOGEN_LAMP DEUTERIUM_LAMP SOLAR_SIMULATOR "
    "BROAD_SPECTRUM",
    "ElectrochemistryType": "UNSPECIFIED CUSTOM CONSTANT_CURRENT CONSTANT_VOLTAGE",
    "FlowType": "UNSPECIFIED CUSTOM PLUG_FLOW_REACTOR CONTINUOUS_STIRRED_TANK_REACTOR PACKED_BED_REACTOR",
    "ReactionWorkupType": "UNSPECIFIED CUSTOM ADDITION ALIQUOT TEMPERATURE CONCENTRATION EXTRACTION FILTRATION WASH "
    "DRY_IN_VACUUM DRY_WITH_MATERIAL FLASH_CHROMATOGRAPHY OTHER_CHROMATOGRAPHY SCAVENGING WAIT STIRRING PH_ADJUST "
    "DISSOLUTION DISTILLATION",
    "ProductMeasurementType": "UNSPECIFIED CUSTOM IDENTITY YIELD SELECTIVITY PURITY AREA COUNTS INTENSITY AMOUNT",
}
"""Names of the enumerations' values, numbered from 0 in this order."""
_ALIASES = {"ReactionIdentifierType": {"ATOM_MAPPED_SMILES": 3, "NAME": 5}}
"""Names that earlier versions of the schema had for a value."""

_MESSAGES: dict[str, str] = {
    "Dataset": "1 name string, 2 description string, 3 reactions Reaction*, 5 dataset_id string",
    "Reaction": "1 identifiers ReactionIdentifier*, 2 inputs InputsEntry*, 4 conditions ReactionConditions, "
    "5 notes ReactionNotes, 7 workups ReactionWorkup*, 8 outcomes ReactionOutcome*, 10 reaction_id string",
    "ReactionIdentifier": "1 type ReactionIdentifierType, 3 value string",
    "InputsEntry": "1 key string, 2 value ReactionInput",
    "ReactionInput": "1 components Compound*, 3 addition_order int32, 5 addition_speed AdditionSpeed, "
    "6 addition_duration Time, 9 addition_temperature Temperature",
    "AdditionSpeed": "1 type AdditionSpeedType",
    "Compound": "1 identifiers CompoundIdentifier*, 2 amount Amount, 3 reaction_role ReactionRoleType, "
    "5 preparations CompoundPreparation*",
    "CompoundPreparation": "2 details string",
    "CompoundIdentifier": "1 type CompoundIdentifierType, 3 value string",
    "Amount": "1 mass Mass, 2 moles Moles, 3 volume Volume",
    "Mass": "1 value float, 3 units MassUnit",
    "Moles": "1 value float, 3 units MolesUnit",
    "Volume": "1 value float, 3 units VolumeUnit",
    "Time": "1 value float, 3 units TimeUnit",
    "Temperature": "1 value float, 3 units TemperatureUnit",
    "Pressure": "1 value float, 3 units PressureUnit",
    "ReactionConditions": "1 temperature TemperatureConditions, 2 pressure PressureConditions, "
    "3 stirring StirringConditions, 4 illumination IlluminationConditions, 5 electrochemistry "
    "ElectrochemistryConditions, 6 flow FlowConditions, 7 reflux bool, 8 ph float, 10 details string",
    "TemperatureConditions": "1 control TemperatureControl, 2 setpoint Temperature",
    "TemperatureControl": "1 type TemperatureControlType",
    "PressureConditions": "2 setpoint Pressure, 3 atmosphere Atmosphere",
    "Atmosphere": "1 type AtmosphereType",
    "StirringConditions": "1 type StirringMethodType",
    "IlluminationConditions": "1 type IlluminationType",
    "ElectrochemistryConditions": "1 type ElectrochemistryType",
    "FlowConditions": "1 type FlowType",
    "ReactionNotes": "9 procedure_details string",
    "ReactionWorkup": "1 type ReactionWorkupType, 2 details string, 3 duration Time, 4 input ReactionInput, "
    "6 temperature TemperatureConditions, 7 keep_phase string, 9 target_ph float",
    "ReactionOutcome": "1 reaction_time Time, 3 products ProductCompound*",
    "ProductCompound": "1 identifiers CompoundIdentifier*, 2 is_desired_product bool, 3 measurements "
    "ProductMeasurement*",
    "ProductMeasurement": "2 type ProductMeasurementType, 8 percentage Percentage",
    "Percentage": "1 value float",
}
_NUMBERED = {"REACTION_CXSMILES": 6}
_SCALARS = {"float": 2, "int32": 5, "bool": 8, "string": 9}
_ENUM, _MESSAGE = 14, 11
_PACKAGE = "labgym.ord"


@lru_cache(maxsize=1)
def messages() -> tuple[Any, Any]:
    """Return the classes of the messages Dataset and Reaction.

    Raises:
        MissingDependencyError: protobuf is not installed.
    """
    with optional_package("protobuf", "reading Open Reaction Database files", "ord"):
        from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
    file = descriptor_pb2.FileDescriptorProto(name="labgym/ord.proto", package=_PACKAGE, syntax="proto2")
    for name, values in _ENUMS.items():
        # Values of all enumerations in a scope must differ, so each enumeration is inside its own message.
        enum = file.message_type.add(name=f"{name}Scope").enum_type.add(name=name)
        for place, value in enumerate(values.split()):
            enum.value.add(name=value, number=_NUMBERED.get(value, place))
        for alias, place in _ALIASES.get(name, {}).items():
            enum.options.allow_alias = True
            enum.value.add(name=alias, number=place)
    for name, fields in _MESSAGES.items():
        message = file.message_type.add(name=name)
        for text in fields.split(", "):
            number, field, kind = text.split()
            _add_field(message, int(number), field, kind)
    # On the wire and in text, a map is a repeated message of key and value.
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file)
    classes = [
        message_factory.GetMessageClass(pool.FindMessageTypeByName(f"{_PACKAGE}.{n}")) for n in ("Dataset", "Reaction")
    ]
    return classes[0], classes[1]


def _add_field(message: Any, number: int, name: str, kind: str) -> None:
    field = message.field.add(name=name, number=number, label=3 if kind.endswith("*") else 1)
    kind = kind.removesuffix("*")
    if kind in _SCALARS:
        field.type = _SCALARS[kind]
    elif kind in _ENUMS:
        field.type, field.type_name = _ENUM, f".{_PACKAGE}.{kind}Scope.{kind}"
    else:
        field.type, field.type_name = _MESSAGE, f".{_PACKAGE}.{kind}"
