"""Which words of laboratory English name substances: none of the ordinary ones, nearly all names of substances."""

from __future__ import annotations

import pytest

from labgym.assets import Catalog
from labgym.protocols.language import mentions
from labgym.protocols.synthesis.unlisted import unlisted

CATALOG = Catalog.load()
ORDINARY_TEXT = """
    system medium internal residual thermocouple thoroughly title remainder periphery outlet inlet baseline septum
    plunger meniscus headspace additional vertical horizontal manual routine triplicate duplicate aliquot supernatant
    filtrate retentate distillate condensate effluent exotherm endpoint turnover throughput yellowish bluish brownish
    tan beige crimson lustrous flocculent gelatinous viscous turbid opaque translucent fluffy sticky tarry granular
    needle prism platelet shard lump clump crust skin film sheen haze plume fume vapor mist froth foam scum sludge
    slurry cake bed plug frit pad wick thimble sleeve jacket manifold bubbler stopcock adapter clamp stand ring tripod
    gauze spatula scoop funnel stopper bung cork vial ampoule cuvette capillary tubing hose syringe cannula balloon
    bladder gasket seal grease lubricant parafilm foil wrap towel wipe tissue blotter paper litmus indicator standard
    reference blank control sample batch lot vendor supplier catalogue bottle drum carboy jug tray rack shelf cabinet
    drawer hood sash bench sink drain faucet valve regulator gauge pump motor paddle impeller stirrer hotplate mantle
    thermostat chiller cryostat circulator probe sensor electrode meter balance scale timer clock alarm apparatus
    assembly portion fraction interval duration overnight weekend morning technician operator chemist supervisor
    notebook logbook label marker pencil procedure protocol literature supporting appendix footnote scheme figure
    table entry general typical representative analogous previous subsequent former latter respective corresponding
    appropriate suitable sufficient excessive negligible substantial moderate vigorous gentle gradual rapid prompt
    immediate cautious careful intermittent continuous uniform homogeneous heterogeneous biphasic uppermost lowermost
    bottom top middle interior exterior surface interface boundary layer stratum emulsion rag dispersion suspension
    agitation turbulence convection radiation ambient subambient elevated reduced atmospheric hydrostatic gravity
    vacuum suction pressure throttle bleed vent purge sparge blanket counterflow trickle stream jet spray drip droplet
    bead globule bubble swirl vortex whirl tumble shake invert decant siphon pipet transfer rinse flush scrub soak
    steep macerate triturate pulverize grind mortar pestle sieve mesh strainer colander cheesecloth muslin cotton wool
    glass plastic ceramic porcelain stainless steel copper-coil rubber silicone-oil quartz teflon-coated magnetic
    overhead mechanical electrical digital analog calibrated tared preweighed predried flame-dried oven-dried freshly
    recently newly initially finally eventually meanwhile thereafter whereupon therefore however otherwise accordingly
    essentially virtually completely partially approximately roughly
"""
TRIVIAL_TEXT = """
    camphor estrone geraniol limonene carvone menthone squalene citral pinene vanillin ninhydrin saccharin glucose
    fructose sucrose isatin tetralin decalin lutidine collidine picoline mesitylene durene sulfolane diglyme glyoxal
    chloral acrolein isoprene indene fluorene phenanthrene pyrene anthraquinone benzoquinone hydroquinone catechol
    thymol carvacrol eugenol cumene cymene veratrole guaiacol quinine strychnine caffeine nicotine tropinone
    theobromine adenine guanine cytosine thymine uracil alloxan hydantoin oxindole indoline carbazole acridine
    phenothiazine thiourea semicarbazide hydroxylamine guanidine cyanamide melamine dicyandiamide acetylacetone
    dimedone chromone flavone xanthone fluorenone benzil benzoin anisoin furoin hydrobenzoin pinacol glyceraldehyde
    cholesterol ergosterol lanosterol testosterone progesterone cortisone borneol fenchone pulegone ionone nerol
    farnesol phytol linalool myrcene ocimene caryophyllene humulene maltose lactose ribose xylose mannitol sorbitol
    inositol alanine leucine proline tryptophan histidine lysine cysteine methionine serine threonine glutamine
    asparagine tyrosine phenylalanine creatine betaine choline dopamine serotonin melatonin tyramine tryptamine
    phenethylamine putrescine cadaverine spermidine piperonal anisaldehyde cinnamaldehyde crotonaldehyde furfural
    valeraldehyde phorone isophorone cyclopentanone cycloheptanone tetralone indanone propiophenone butyrophenone
    stilbene tolane diphenylacetylene phenylacetylene azulene norbornene norbornadiene dicyclopentadiene
    cyclooctadiene cyclododecatriene adamantane cubane
"""
SYSTEMATIC_TEXT = """
    2-bromothiophene 4-methoxyacetophenone cyclooctanone 3-nitrobenzaldehyde methylcyclohexane 1,2-dibromoethane
    ethyl-4-oxobutanoate dimethylaminobenzaldehyde phenylglyoxal triphenylphosphine-oxide benzyltrimethylsilane
    2-chloropyridine isobutyronitrile tetramethylethylenediamine diphenylmethanol bromocyclohexane hexachloroethane
    2,6-di-tert-butylpyridine 4-fluoroaniline diethylmalonate trimethylorthoformate cyclopropylamine propargylamine
    methylthiazole benzofuran dibenzothiophene octanoyl-chloride dodecanethiol hexafluoroisopropanol phenylhydrazine
    4-chlorobenzophenone nitrosobenzene diiodomethane tributyltin-hydride bromoacetonitrile methacrolein
    chlorosulfonylisocyanate
"""
ORDINARY, TRIVIAL, SYSTEMATIC = (text.split() for text in (ORDINARY_TEXT, TRIVIAL_TEXT, SYSTEMATIC_TEXT))
SENTENCES = (
    "Stir the mixture with {} at 25 C for 1 h.",
    "Pour into the {}, then filter.",
    "The {} was heated and stirred.",
    "Dissolve in ethanol and add {} slowly.",
)


def is_taken(word: str, sentence: str) -> bool:
    """Return whether a word of a sentence is taken for a substance, of the catalog or unknown."""
    text = sentence.format(word)
    start = text.index(word)
    named = mentions(text, CATALOG)
    spans = [*unlisted(text, named), *((mention.start, mention.end) for mention in named)]
    return any(first < start + len(word) and start < last for first, last in spans)


@pytest.mark.parametrize("sentence", SENTENCES)
def test_no_ordinary_word_is_taken_for_a_substance(sentence: str) -> None:
    foreign = [
        word
        for word in ORDINARY
        if any(
            start <= sentence.index("{}") < end
            for start, end in unlisted(sentence.format(word), mentions(sentence.format(word), CATALOG))
        )
    ]
    assert len(ORDINARY) >= 300
    assert foreign == []


@pytest.mark.parametrize("sentence", [*SENTENCES[:1], SENTENCES[3], "A solution of {} (5 g) in ethanol."])
@pytest.mark.parametrize("names", [TRIVIAL, SYSTEMATIC], ids=["trivial", "systematic"])
def test_nearly_every_name_of_a_substance_is_taken_for_one(names: list[str], sentence: str) -> None:
    missed = [name for name in names if not is_taken(name, sentence)]
    assert len(missed) <= 0.05 * len(names), missed


@pytest.mark.parametrize(
    "text",
    [
        "The system was cooled and the internal temperature, read by a thermocouple, rose to 25 C.",
        "The residual medium was removed and the title compound was washed thoroughly.",
        "A mixture of hexanes and ethyl acetate (1:1 v:v) was used (J. Am. Chem. Soc. procedure).",
    ],
)
def test_sentences_of_published_procedures_have_no_unknown_substances(text: str) -> None:
    assert [text[start:end] for start, end in unlisted(text, mentions(text, CATALOG))] == []
