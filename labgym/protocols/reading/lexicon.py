"""The words of procedures: operations with what they take, nouns for the batch, qualities, and names of substances.

A word that no table knows is a name if its form says so (`names_substance`), or if an amount stands with it.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

from labgym.protocols.experiments.model import Verb

Frame = Literal["theme", "with", "in", "onto", "from", "hold", "over", "between", "result", "none", "refers"]
"""Where a verb names its substances: its object ("theme"), after with, in, onto, from, over or between, or nowhere."""


@dataclass(frozen=True)
class VerbWord:
    """An operation word: the verb, where its substances stand, and whether the word is a noun."""

    verb: Verb
    frame: Frame
    noun: bool = False


_ED = r"(?:e[sd]?|ing|ed|s)?"
_VERBS: tuple[tuple[str, Verb, Frame], ...] = (
    (rf"add{_ED}|addition", "Add", "theme"),
    (rf"charg{_ED}", "Add", "theme"),
    (rf"introduc{_ED}|plac{_ED}|combin{_ED}|mix{_ED}|put|inject{_ED}|bubbl{_ED}|admix{_ED}|blend{_ED}|load{_ED}", "Add", "theme"),
    (rf"convert{_ED}|react{_ED}|condens{_ED}|treat{_ED}|treatment|dilut{_ED}|dilution|dilute[ds]?|subjected|admixed", "Add", "with"),
    (rf"siphon{_ED}|pour{_ED}", "Pour", "onto"),
    (rf"quench{_ED}|terminat{_ED}|decompos{_ED}|destroy{_ED}|hydroly[sz]{_ED}", "Quench", "with"),
    (rf"acidif(?:y|ied|ies|ying)|acidification|basif(?:y|ied|ies|ying)|basification|alkali[sz]{_ED}|alkalinized|neutrali[sz]{_ED}|neutralization|adjust{_ED}", "AdjustPH", "with"),
    (rf"stir(?:s|red|ring)?|agitat{_ED}|agitation|shak(?:e|es|en|ing)|shook|swirl{_ED}", "Stir", "hold"),
    (rf"heat{_ED}|warm{_ED}", "Heat", "hold"),
    (rf"cool{_ED}|chill{_ED}", "Cool", "hold"),
    (rf"brought|rais{_ED}|bring{_ED}|lowered|rises?|rose", "SetTemperature", "hold"),
    (rf"reflux{_ED}|boil{_ED}", "Reflux", "hold"),
    (rf"stand(?:s|ing)?|stood|keep(?:s|ing)?|kept|le(?:ft|ave|aving)|held|hold(?:s|ing)?|maintain{_ED}|incubat{_ED}|ag(?:ed|ing)|allow(?:ed|ing)?|let|continu{_ED}|sit", "Wait", "hold"),
    (rf"hydrogenat{_ED}|hydrogenation|hydrogenolyzed", "Hydrogenate", "with"),
    (rf"irradiat{_ED}|photoly[sz]{_ED}", "Irradiate", "hold"),
    (rf"microwaved", "Microwave", "hold"),
    (rf"sonicat{_ED}|ultrasonicat{_ED}", "Sonicate", "hold"),
    (rf"sublim{_ED}", "Sublime", "hold"),
    (rf"purg{_ED}|degas{_ED}|de-gassed|degassed|flush{_ED}|evacuat{_ED}|inflated|backfill{_ED}", "Purge", "hold"),
    (rf"concentrat{_ED}|concentration|evaporat{_ED}|evaporation|strip(?:ped|ping|s)?|rotovap\w*|rotary-evaporated|azeotrop{_ED}|lyophili[sz]{_ED}|lyophili[sz]ation|freeze-dried", "Concentrate", "none"),
    (rf"remov{_ED}|removal|eliminat{_ED}|elimination|distill?ed-off|freed", "Concentrate", "none"),
    (rf"distill?{_ED}|distillation", "Distill", "none"),
    (rf"extract(?:ed|ing|s)?|extraction|back-extracted|reextracted|re-extracted", "Extract", "with"),
    (rf"wash(?:ed|ing|es)?|rins{_ED}", "Wash", "with"),
    (rf"partition{_ED}", "Partition", "between"),
    (rf"separat{_ED}|separation", "PhaseSeparation", "none"),
    (rf"dry|dried|drying|dries", "DrySolution", "over"),
    (rf"filter{_ED}|filtrat(?:ion|ed)|collect{_ED}|suction-filtered", "Filter", "over"),
    (rf"recrystalli[sz]{_ED}|recrystalli[sz]ation|re-crystallized", "Recrystallize", "from"),
    (rf"crystalli[sz]{_ED}|crystalli[sz]ation|precipitat(?:ed|ing|es)|precipitation|reprecipitated", "Crystallize", "from"),
    (rf"triturat{_ED}|trituration", "Triturate", "with"),
    (rf"chromatograph(?:ed|y|ing)|chromatographic|elut(?:ed|ing|ion)", "Chromatograph", "over"),
    (rf"purif(?:y|ied|ies|ying)|purification", "Purify", "none"),
    (rf"transfer(?:red|ring|s)?", "Transfer", "none"),
    (rf"monitor{_ED}|followed-by-tlc", "Monitor", "none"),
    (rf"give[ns]?|gave|giving|afford{_ED}|yield(?:ed|ing|s)?|provid{_ED}|furnish{_ED}|obtain{_ED}|recover{_ED}|isolat{_ED}|produc{_ED}|get|deliver{_ED}|result(?:ed|ing) in", "Yield", "result"),
    (rf"dissolv{_ED}|redissolv{_ED}|re-dissolved|taken|dissolution", "Dissolve", "in"),
    (rf"suspend{_ED}|slurri(?:ed|es)|slurry(?:ing)|resuspend{_ED}|dispers{_ED}", "MakeSolution", "in"),
    (rf"seal(?:ed|ing)?|fitted|equipped|repeat(?:ed|ing)?", "Wait", "none"),
)  # fmt: skip
NOUNS = frozenset(
    "addition treatment dilution acidification basification neutralization agitation hydrogenation concentration evaporation "
    "lyophilization removal elimination distillation extraction separation filtration recrystallization recrystallisation "
    "crystallization crystallisation precipitation trituration chromatography chromatographic purification elution "
    "dissolution".split()
)
"""Operation words that are nouns."""
SOLUTIONS = frozenset("solution suspension mixture slurry dispersion solutions emulsion mixtures".split())
"""Nouns that hold their contents: "a solution of A in B"."""
BATCH = frozenset(
    "reaction residue residues filtrate filtrates product products solid solids precipitate crystals layer layers phase phases "
    "extract extracts organics material materials oil reactants contents fractions fraction whole mass volatiles solvent solvents "
    "insolubles catalyst liquid crude filtercake cake foam gum powder slurry compound catalyst concentrate supernatant latter "
    "washings mother liquor liquors excess melt paste substance system flask vessel tube reactor vial bottle funnel autoclave "
    "chloroform-layer distillate eluate batch it this which that they ingredients components evaporate syrup sample "
    "desiccant eluent eluant isomers isomer regioisomer enantiomer mixtures volatile slurries material precipitates "
    "phase. volume vessel. pot tubes flasks".split()
)
"""Nouns for the batch, its parts and its vessel; they name no substance."""
VESSELS = frozenset("flask vessel tube reactor vial bottle autoclave funnel beaker pot bomb kettle".split())
SOLID = frozenset(
    "solid solids precipitate precipitates crystals crystal cake powder filtercake crystalline flakes needles".split()
)
QUALITIES = frozenset(
    "aqueous aq aq. saturated sat. sat satd. satd sat'd concentrated conc. conc dilute diluted dil. dil dry anhydrous absolute glacial hot "
    "cold warm ice-cold ice-cooled boiling crude pure fresh freshly distilled additional more excess further remaining solid "
    "liquid gaseous powdered half-saturated commercial commercially available deionized deionised distilled neat "
    "abs. abs degassed normal chilled cooled fuming precooled finely ground catalytic iced above chilled chopped crystallised "
    "crystallized purified dried separate total small little large amount amounts quantity quantities excess equal "
    "molar racemic technical reagent-grade spectral dark light yellow white pale colorless colourless brown orange red "
    "portions portion volume volumes drops equivalent equivalents inorganic each minimum sufficient various certain "
    "suitable weak strong stirred resulting resultant corresponding combined desired obtained isolated preceding new "
    "vigorously slowly carefully successively rapidly quickly gently initially subsequently approximately about approx. ca. "
    "ca approx over-night well quite mildly 60% dispersed oily viscous thick thin clear turbid milky gummy milky "
    "half-concentrated ethereal methanolic ethanolic alcoholic basic acidic neutral".split()
)
"""Adjectives and measures before a name that are no part of it."""
SOLVENT_ADJECTIVES = frozenset("ethereal ethanolic methanolic alcoholic".split())
WORDS_OF_AMOUNT = {
    "saturated": "saturated", "sat.": "saturated", "sat": "saturated", "satd": "saturated", "satd.": "saturated",
    "sat'd": "saturated", "concentrated": "concentrated", "conc.": "concentrated", "conc": "concentrated",
    "dilute": "dilute", "diluted": "dilute", "dil.": "dilute", "dil": "dilute", "excess": "excess",
    "catalytic": "catalytic", "aqueous": "aqueous", "aq.": "aqueous", "aq": "aqueous", "glacial": "glacial",
    "half-saturated": "half-saturated", "half-concentrated": "half-concentrated", "little": "little", "equal": "equal",
}  # fmt: skip
PREPOSITIONS = frozenset(
    "to in with of from over under at for by into onto on through between until after before during via using against within "
    "without upon as among towards per across containing employing than except beyond off out until when while once whilst "
    "because since if whereupon where whereby so".split()
)
AUXILIARIES = frozenset(
    "was were is are be been being had has have may can could should would will must then-was am do does did not".split()
)
DETERMINERS = frozenset(
    "a an the this that these those said such its their his both all each any some no same its".split()
)
MANNERS = {
    "dropwise": "dropwise", "drop-wise": "dropwise", "drop": "", "portionwise": "portionwise", "portion-wise": "portionwise",
    "slowly": "slowly", "gradually": "slowly", "rapidly": "quickly", "quickly": "quickly", "carefully": "slowly",
    "progressively": "slowly",
}  # fmt: skip
GASES = {
    "nitrogen": "nitrogen",
    "n2": "nitrogen",
    "argon": "argon",
    "ar": "argon",
    "hydrogen": "hydrogen",
    "h2": "hydrogen",
    "air": "air",
}
OTHER = frozenset(
    "then and or subsequently followed thus thereto thereafter therefrom there thereof therein hence also further furthermore afterwards again "
    "temperature temperatures time times period bath pressure vacuum vacuo stirring heating cooling atmosphere inert rotary evaporator oven desiccator "
    "dryness hood pump reduced high low lower upper same meanwhile meantime course rate way manner means method procedure process step "
    "example examples scheme preparation intermediate part parts half end beginning once twice thrice every first second third last next "
    "one two three four five six ten another other others initial finally final following title titled complete completion completed "
    "completely until exothermic exotherm gas evolution ceased starting stage internal external water-bath oil-bath ice-bath "
    "temp temp. approximately about around least most almost only just still very gentle vigorous mechanical magnetic stirrer bar "
    "condenser thermometer thermocouple inlet dropping round bottom bottomed round-bottomed round-bottom necked neck three-necked jacketed glass sealed "
    "pressure-tube column plug pad frit fritted filter paper short flash silica-gel-column preparative prep prep. reverse reversed reverse-phase reversed-phase phase-hplc hplc rp-hplc tlc prep-hplc lc lcms gc "
    "technique techniques conditions condition standard use used usual directly without allowed it which that who what it's so than "
    "wt weight total yield yields theory theoretical mp m.p. b.p. bp melting boiling point range refractive index rf "
    "combined containing gradient eluant eluent eluents ratio system mobile stationary quantity basis form free base salt color colour "
    "formed form forms during being been their its below above between within whose when after before ref lit chem soc int ed "
    "suction aspirator water-aspirator careful addition quantitative colored coloured white yellow solidified solidifies successively sequentially respectively "
    "consumed monitored minutes hours hour min h overnight days day night weekend room ambient ca equal ml g mg mmol mol l temperature. exclusion light influence "
    "darkened observed showed shows indicated indicates remains remain reaction-time reached reach reaches appears appeared became becomes "
    "using via per not no yes more less many few several additional continued identified analysis analyzed analysed analytical data found calcd calculated "
    "purity pure optical rotation revealed spectrum spectra spectroscopy nmr ms ir uv chromatogram values value isomeric diastereomers diastereomer mixture-of "
    "made make makes making carried out up off down aside through carrying effected performed conducted achieved accomplished "
    "subject substituting substituted replaced instead place name compound-of formula structure general similar analogous identical described indicated "
    "known literature commercially commercial sigma aldrich merck aldrich. fluka prepared synthesized synthesised obtained-in derived converted conversion "
    "generate generated form formed induce induces order remove ensure avoid maintain keep prevent presence absence help aid assistance "
    "size volume amount scale batch approximate mesh grade washings back onto thereto neat ones whereupon thereby slow fast".split()
)
"""Words that name no substance and no operation."""
_STOPS = PREPOSITIONS | AUXILIARIES | DETERMINERS | OTHER | frozenset(MANNERS)

SUBSTANCES = frozenset(
    "water ice brine saline ether ethers hexane hexanes pentane heptane cyclohexane toluene benzene xylene xylenes methanol ethanol "
    "isopropanol propanol butanol dioxane acetone butanone chloroform dichloromethane pyridine piperidine morpholine pyrrolidine triethylamine "
    "celite hyflo darco norit silica alumina charcoal carbon magnesia kieselgel kieselguhr florisil sulfur sulphur iodine bromine "
    "chlorine hydrogen nitrogen oxygen argon ammonia zinc iron tin magnesium sodium potassium lithium calcium copper palladium platinum "
    "nickel raney mercury aluminum aluminium acid hydrochloric sulfuric sulphuric nitric phosphoric acetic formic citric tartaric oxalic "
    "trifluoroacetic methanesulfonic hydrobromic perchloric boric potash alcohol alcohols ethylacetate petrol ligroin skellysolve "
    "anhydride chloride bromide iodide fluoride hydride hydroxide carbonate bicarbonate sulfate sulphate phosphate nitrate acetate "
    "dmf dmso thf dcm dce dme dma dmac nmp mtbe tbme ipa tea tfa tfaa dipea diea dbu dmap edc edci hobt hatu tbtu pybop dcc dic "
    "cdi nbs ncs nis mcpba dibal dibal-h lah lda nabh4 hcl naoh koh lioh hbr h2so4 hno3 etoh meoh etoac acoh hoac mecn "
    "ea pe dea dppf binap bop dead diad tbaf tbscl tmscl tms boc2o ppts tsoh ptsa n-buli t-buli buli lihmds khmds nahmds naoac et3n "
    "et2o diglyme glyme acetonitrile peroxide reagent resin solvent-free lawesson's diatomaceous earth hydrazine urea thiourea "
    "phenol aniline resorcinol glucose gsh tris-hcl buffer hydrate oxide ester amine base-salt alcohol molecular sieves pd/c "
    "lialh4 socl2 pocl3 pcl5 pcl3 cyanide azide thiocyanate borohydride permanganate hypochlorite thiosulfate bisulfite "
    "metabisulfite chromate dichromate tartrate formaldehyde paraformaldehyde glycol glycerol acetylene ethylene propylene "
    "isobutylene oxone salt catalyst adam's zeolite amberlite dowex hexane/etoac cyclopentanone saligenin dextrose starch cellulose".split()
)
"""Names and parts of names whose form says nothing."""
_SUFFIX = re.compile(
    r"(?:(?:^|[a-z)\]])(?:ane|ene|yne|anol|enol|ynol|inol|erol|ylol|diol|triol|thiol|olate|oxide|amine|imine|amide|imide|idine|azine|azole|"
    r"idine|ucine|anine|onine|onate|oate|inate|ylate|nitrate|phosphate|phosphite|phosphine|borane|silane|stannane|nitrile|"
    r"chloride|bromide|iodide|fluoride|hydride|hydroxide|carbonate|sulfate|sulphate|sulfite|sulfide|sulphide|hydrate|hydrochloride|"
    r"hydrobromide|tosylate|mesylate|triflate|acetate|formate|benzoate|oxalate|citrate|tartrate|maleate|fumarate|succinate|"
    r"oic|ylic|onic|inic|thioic|furan|pyran|indole|phenol|toluene|anisole|aniline|aldehyde|anone|enone|ynone|quinone|"
    r"lactone|lactam|carbamate|urea|guanidine|hydrazine|hydrazone|hydroxylamine|oxime|azide|cyanide|cyanate|oxirane|"
    r"benzyl|phenyl|methyl|ethyl|propyl|butyl|allyl|vinyl|acetyl|benzoyl|tosyl|silyl|chloro|bromo|iodo|fluoro|nitro|hydroxy|"
    r"methoxy|ethoxy|isidine|uidine|oline|idone|azone|anide|idate|oxylate|ester|anhydride|acid|onium|inium|diethylacetal|acetal|ketal|peroxide|borate|silicate|"
    r"permanganate|manganate|chromate|oxazole|thiazole|pyridine|pyrrole|purine|quinoline|ylurea|glyme|carbinol|thiophene|propane|"
    r"phthalate|steride|sterol|cholesterol|glycine|cysteine|lysine|proline|serine|arginine|alanine|tyrosine|leucine|valine|ephedrine|"
    r"isoindole|pinacol|amino|alcohol|enal|anal|acrylate|methacrylate|silane|siloxane|ketone|ethylate|methylate|butoxide|"
    r"creatine|adenine|cytosine|guanine|thymine|uracil|glucoside|pyranose|furanose|ferrocene))s?$",
    re.IGNORECASE,
)
_SHORT = re.compile(
    r"^(?:methyl|ethyl|propyl|butyl|phenyl|benzyl|allyl|vinyl|acetyl|benzoyl|trityl|tosyl|mesyl|acryl|oxalyl|thionyl|"
    r"phosphorus|phosphorous|phosphoryl|sulfuryl|boron|aluminum|titanium|chromium|osmium|manganese|cesium|caesium|barium|"
    r"silver|mercuric|ferric|ferrous|cupric|cuprous|stannous|stannic|ammonium|lithium|hydrogen|sodium|potassium|calcium|magnesium|"
    r"n-|o-|p-|m-|tert-|t-|sec-|iso|di|tri|tetra|bis|cis-|trans-|racemic|mono|hexa|penta|acet|form|benz|amino|nitro|chloro|bromo|iodo|"
    r"petroleum|mineral|silica|activated|lithium|selenium|ethereal|mono|tartaric|maleic|fumaric|succinic|glutaric|malonic|lactic|benzoic|"
    r"tetrabutylammonium|tetrakis|dichloro|dimethyl|diethyl|diisopropyl|trimethyl|triethyl|triphenyl|tributyl|diphenyl|"
    r"camphorsulfonic|palladium|platinum|rhodium|ruthenium|iridium|gold|cobalt|zirconium|indium|cerium|ceric|lanthanum|"
    r"samarium|ytterbium|scandium|bismuth|antimony|arsenic|strontium|rubidium|thallium|lead)$",
    re.IGNORECASE,
)
_ELEMENT = (
    "H|He|Li|Be|B|C|N|O|F|Na|Mg|Al|Si|P|S|Cl|K|Ca|Sc|Ti|V|Cr|Mn|Fe|Co|Ni|Cu|Zn|Ga|Ge|As|Se|Br|Rb|Sr|Y|Zr|Nb|Mo|Ru|Rh|Pd|"
    "Ag|Cd|In|Sn|Sb|Te|I|Cs|Ba|La|Ce|Sm|Yb|Hf|Ta|W|Re|Os|Ir|Pt|Au|Hg|Tl|Pb|Bi|Me|Et|Pr|Bu|Ph|Ac|Ts|Ms|Tf|Bn|Bz|Boc|OAc|dba|Ar|D"
)
_FORMULA = re.compile(
    rf"^(?:[nist]-|i|t|n)?(?:(?:{_ELEMENT})\d{{0,2}}|[()\[\]·.*+-]|\d{{1,2}}(?=[A-Z(])|(?<=\))\d|II+V?|IV|aq)+$"
)
_DIGIT_LETTERS = re.compile(
    r"\d[,\d']*-[A-Za-z(\[]|[a-z)\]]-\d|\d[A-Z]-|[(\[]\d|^[NOS],[NOS]|^[NOSRE]-[a-z]|^\((?:[RSEZ±+-]|\d)", re.ASCII
)
_GREEK = re.compile(r"^[α-ωΑ-Ω]")
_CODE = re.compile(r"^\(?(?:\d{1,3}[a-z]?|[IVX]{1,5}|[A-Z]{1,2}-?\d{1,3}[a-z]?)\)?$")


@lru_cache(maxsize=1)
def _verb_patterns() -> tuple[tuple[re.Pattern[str], Verb, Frame], ...]:
    return tuple((re.compile(rf"^(?:{pattern})$"), verb, frame) for pattern, verb, frame in _VERBS)


@lru_cache(maxsize=4096)
def verb_word(word: str) -> VerbWord | None:
    """Return the operation that a word in lower case names, or None."""
    if len(word) > 24:
        return None
    for pattern, verb, frame in _verb_patterns():
        if pattern.match(word):
            return VerbWord(verb, frame, word in NOUNS)
    return None


@lru_cache(maxsize=8192)
def names_substance(word: str) -> bool:
    """Return whether the form of a word says that it is a name of a substance or part of one."""
    lower = word.lower().rstrip(".,;:")
    if len(word) > 400:
        return False
    if lower in SUBSTANCES:
        return True
    if lower in _STOPS or lower in BATCH or lower in SOLUTIONS or verb_word(lower) is not None:
        return False
    if _SHORT.match(word) or _GREEK.match(word):
        return True
    if "/" in word.strip("/") and len(word) < 60 and "[" not in word:
        return any(names_substance(part) for part in word.split("/") if part)
    if any(map(str.isdigit, word)) and len(word) > 3 and _DIGIT_LETTERS.search(word):
        return True
    if (
        len(word) <= 40
        and len(word) > 1
        and _FORMULA.match(word)
        and (any(map(str.isdigit, word)) or sum(map(str.isupper, word)) > 1 or "-" in word)
    ):
        return True
    if "-" in word and len(word) > 6 and any(names_substance(part) for part in word.split("-") if len(part) > 2):
        return True
    return len(word) > 4 and _SUFFIX.search(word) is not None


def is_stop(word: str) -> bool:
    """Return whether a word in lower case is known to name no substance and no operation."""
    return word in _STOPS


def is_code(word: str) -> bool:
    """Return whether a word numbers a compound: "12b", "(IV)"."""
    return _CODE.match(word) is not None
