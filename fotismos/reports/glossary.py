"""The technical terms of the page, each with one sentence: its help, and its list of terms."""

from fotismos.comparisons.departure.metrics import METRICS, RATIO
from fotismos.reference.planning import effects

Terms = dict[tuple[str, ...], str]
"""A sentence by the names under which a term is shown."""

RESULTS: Terms = {
    ("shape", "mean shape", "ΔE2000, best exposure", "after the best exposure"): (
        "The mean that remains after the one exposure of the textbook image that lowers it most:"
        " no exposure would remove it."
    ),
    ("level", "level mean − shape"): (
        "The part of the mean that the best exposure removes: an error of brightness alone."
    ),
    ("best exposure", "factor"): (
        "The one factor on the textbook image that makes the metric’s mean smallest."
    ),
    ("noise", "noise floor", "ΔE2000, noise floor"): (
        "The mean that the physical picture’s own noise gives: its distance from itself with noise"
        " of its standard error added."
    ),
    ("without noise", "without noise 95 %"): (
        "The mean without the part that is due to noise, with a 95 % interval. If it contains 0,"
        " there may be no error."
    ),
    ("significant", "certain to differ", "certain and visible"): (
        "Pixels whose linear difference is more than noise, however small. At most 5 % of these"
        " marks are expected to be wrong; more samples show more of them."
    ),
    ("undetermined",): (
        "Not certain to differ, but noise might hide a visible difference there: rare bright paths"
        " may be missing, even where the standard error is small."
    ),
    ("not counted",): "Pixels that see no surface are left out of all numbers.",
    ("unchanged",): "Both images as rendered, with one exposure.",
    ("median",): "Half of the values are below it.",
    ("95 %",): "95 % of the pixels are below it.",
    ("95 % interval", "interval"): (
        "The range that holds the true value in 95 of 100 such measurements."
    ),
    ("standard error",): (
        "How far the mean of the samples is likely to be from the true value, because of noise. At"
        " a pixel it is the mean over a square of 2 by 2."
    ),
    ("share of error", "of the error"): "Its part of the sum of ΔE2000 over all pixels.",
    ("mostly", "mostly missing", "because of", "effect", "worth most", "cause", "causes"): (
        "The effect that adds most to the error there."
    ),
    ("needs",): (
        "What makes the scene look right: the fewest effects, brightness, or samples that decide."
    ),
    ("time",): "What the physical picture takes with the samples that make it look right.",
    ("differ visibly", "differs visibly", "pixels that differ visibly"): (
        "The share of the pixels whose ΔE2000 is above the threshold."
    ),
}

VIEWS: Terms = {
    ("textbook", "heuristic"): (
        "The scene shaded by the textbook’s model: ambient, Lambert and Phong."
    ),
    ("physical", "physical reference", "reference"): (
        "The same scene with Mitsuba’s physically based materials and light transport."
    ),
    ("textbook, as seen", "physical, as seen"): (
        "The colour on the screen, after the exposure, as hexadecimal sRGB."
    ),
    ("exposure",): "A factor on both images, in stops: one stop doubles the light.",
    ("map of the error",): "Which measure of the difference the map shows.",
    ("error",): "Grey where no difference is visible; elsewhere, the brighter, the larger.",
}

COSTS: Terms = {
    ("per sample",): "The time that each further sample per pixel adds to an image.",
    ("method",): "A way to render the scene, from flat shading to all light transport.",
    ("samples",): "Samples per pixel: camera rays whose mean is the pixel’s colour.",
    ("x kernel", "x kernel there"): (
        "The time of a sample over that of one of the textbook kernel’s: about the same on any"
        " machine, even a busy one."
    ),
    ("overhead",): "The part of an image’s time that does not depend on its samples.",
    ("first image",): "It also traces and compiles the program.",
    ("passes at",): "The ΔE2000 that 5 % of the pixels exceed: the method passes from there on.",
    ("front",): (
        "No other method is both faster and better. Too close to call: methods of the front whose"
        " time and error may be the same."
    ),
    ("error against time",): (
        "Each point is a method with a number of samples. Further left is faster, lower is better."
    ),
    ("what each effect removes", "what each effect removes and adds", "removed"): (
        "The mean ΔE2000 that simulating the effect removes: a Shapley value, the mean over all"
        " orders of adding the effects."
    ),
    ("adds",): (
        "The extra time that an image’s samples take with the effect: by kernels, or by plans that"
        " add the effects in this order and in the reverse one."
    ),
    ("alone",): "ΔE2000 removed if the effect is added before all others.",
    ("last",): "ΔE2000 removed if the effect is added after all others.",
    ("compilation",): "Time to turn the rendering program into machine code.",
    ("per pass, median",): "A pass is one image with a part of the samples.",
}

PLANS: Terms = {
    (
        "present",
    ): "Whether the scene has the effect, by a rule that is proved or measured. It may still"
    " be too small to be needed to look right.",
    ("rule",): "Why the effect is simulated, or left out without any change of the image.",
    ("guard",): "A few rays with everything simulated, which check that the plan left out nothing.",
    ("pairing",): "How each textbook material and light gets its physical partner.",
    ("misses",): "Quantities in which the physical partner cannot equal the textbook’s.",
}

EFFECTS: Terms = {
    (effect.label, effect.noun) if effect.noun else (effect.label,): effect.meaning
    for effect in effects.EFFECTS
    if effect.meaning
}

METHODS: Terms = {
    ("flat kernel",): "The textbook’s model with one colour for each polygon.",
    ("Gouraud kernel",): "The textbook’s model at the corners of polygons, interpolated between.",
    ("Phong kernel",): "The textbook’s model at each point, with interpolated normals.",
    ("kernel with shadows",): "The textbook’s model with a shadow ray to each light.",
    ("shadow map",): "Shadows from a depth image as each light sees it.",
    ("hemisphere ambient",): (
        "Ambient light in place of interreflection: two colours, for up and down."
    ),
    ("phong BSDF, full transport",): "Textbook materials under all light transport.",
    ("direct",): "Physical materials under the light that comes straight from lights.",
    ("path 3", "path 4", "path 5"): (
        "Path tracing that ends after that many steps; 2 is direct light alone."
    ),
    ("full plan",): "Everything that the scene needs.",
}

GROUPS: dict[str, Terms] = {
    "Results": RESULTS,
    "Views": VIEWS,
    "Costs": COSTS,
    "Plans": PLANS,
    "Effects": EFFECTS,
    "Methods": METHODS,
}


def meanings() -> dict[str, str]:
    """Return the sentence of each name of a term, metrics included."""
    sentences = {
        name: f"{metric.definition} {metric.caution}"
        for metric in METRICS.values()
        for name in (metric.label, metric.heading, f"mean {metric.label}")
    }
    sentences[RATIO.label] = f"Stops: {RATIO.definition}."
    return sentences | {
        name: meaning
        for terms in GROUPS.values()
        for names, meaning in terms.items()
        for name in names
    }
