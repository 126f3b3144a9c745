//! Priors, thresholds and verdict limits, each with its reason and source.
//!
//! A number here decides something: what a diagnosis takes for granted, looks at, gives up or names. Numbers that only set the
//! accuracy of a computation (table sizes, difference steps, probes) stand where they are used.
//!
//! "Sealed scans" are scans drawn by `fieldgap blind make` and diagnosed before their truth was opened. "By judgement" means that no
//! source fixes the value; it was held against such scans as a whole.
//!
//! Limits of the search and of the noise were also halved and doubled one by one, on sealed scans and on scans of another generator. Those that changed
//! no verdict were removed or merged with others of like meaning. Of the ones that remain and changed none, some bound the time that a
//! search takes, and some concern records that these scans do not contain: a converter without a noise of its own, a receiver at full scale, an
//! array of more than 400 elements.

use crate::decisive_limit::DecisiveLimit;

/// The limits that can change a verdict, in the order in which a diagnosis meets them. `fieldgap blind vary` halves and doubles each.
static DECISIVE: [&DecisiveLimit; 20] = [
    &USUAL_ADDITIVE_NOISE,
    &USUAL_NOISE_WITHIN,
    &ROUGHNESS_FACTOR,
    &FLUCTUATION_SHOWN,
    &NOISE_SEARCH_FACTOR,
    &SHIFT_PRIOR_M,
    &EFFECT_SIZE_SPAN,
    &SPREAD_SPAN,
    &ANOTHER_EFFECT,
    &NO_EFFECT,
    &NEAR,
    &MATERIAL,
    &RIVALS,
    &LEAST_EXPECTED_NATS,
    &PATTERN_LIMIT,
    &SINGLE_CAUSE_LIMIT,
    &CERTAIN,
    &SUFFICES_ALONE,
    &RESIDUAL_SHARE,
    &FAINT,
];

/// The limits that can change a verdict.
pub fn decisive_limits() -> &'static [&'static DecisiveLimit] {
    &DECISIVE
}

// Readings: how many are looked at.

/// Pairs of reading and element that a diagnosis works on at most, so that a search takes seconds; of a large array fewer readings
/// are taken. Set by judgement.
pub(crate) const MOST_ELEMENT_READINGS: usize = 400_000;

/// Readings that a diagnosis works on whatever the array. Set by judgement.
pub(crate) const FEWEST_READINGS: usize = 1000;

/// Readings of the first search, of which all readings are fitted again afterwards; and readings over which the signatures of effects and
/// two rivals are compared, with the result scaled to all readings. Set by judgement.
pub(crate) const READINGS_OF_A_SEARCH: usize = 1500;

/// Readings on which an effect is first fitted beside a set that is near the readings already. Set by judgement.
pub(crate) const COARSE_READINGS_NEAR: usize = 1300;

/// The same at least, where a scan has so many: of thirty readings departures of sixty elements were fitted to no effect. Set by judgement.
pub(crate) const FEWEST_READINGS_NEAR: usize = 300;

/// Readings over which starts are compared first, and on which an effect is first fitted beside a set that is far from the readings, where a
/// cause shows in few. Set by judgement.
pub(crate) const FEW_READINGS: usize = 500;

/// Points along a row, and rows of a plane, of a proposed scan while proposals are compared; the result is scaled to the whole scan.
/// No plane of a proposal has fewer. Set by judgement.
pub(crate) const POINTS_ALONG_A_PROPOSED_ROW: usize = 15;

/// Heights of a proposed scan at most: of more, another says little. Set by judgement.
pub(crate) const HEIGHTS_OF_A_PROPOSAL: usize = 6;

/// Side of the recorded planes below which no scan inside them is proposed, m: a wavelength at 40 kHz.
pub(crate) const NARROWEST_PROPOSAL_M: f64 = 8.5e-3;

/// A proposed scan has the readings to separate its rivals by this many times [`SEPARATED_SIGMA`], if the recorded density gives them:
/// what is expected is expected of the rivals as they were fitted. Set by judgement.
pub(crate) const MARGIN_OF_A_PROPOSAL: f64 = 2.0;

// Noise.

/// Additive noise is taken for no less than this share of the largest reading: the steps of a 12-bit converter are 2.4e-4 of its full
/// scale.
pub(crate) const LEAST_ADDITIVE_NOISE: f64 = 1e-4;

/// Noise in quadrature where nothing tells it, as a share of the largest reading: that of a receiver that sees a focus well. Set by judgement.
pub(crate) static USUAL_ADDITIVE_NOISE: DecisiveLimit =
    DecisiveLimit::new("usual-additive-noise", 5e-3);

/// Standard deviation of the logarithm of either part of the noise where nothing tells it: a factor of e. Set by judgement.
pub(crate) static USUAL_NOISE_WITHIN: DecisiveLimit = DecisiveLimit::new("usual-noise-within", 1.0);

/// Pairs of repeats below which they say nothing: eight tell a standard deviation to 25 %.
pub(crate) const FEWEST_REPEATS: usize = 8;

/// Factor by which the fine structure of the residual along rows may underestimate the proportional noise. Set by judgement.
pub(crate) static ROUGHNESS_FACTOR: DecisiveLimit =
    DecisiveLimit::new("roughness-factor", 2.0).beyond_one();

/// Largest proportional noise: five times the usual one. Receivers that are worse are not used; turbulence makes repeats differ by tens of
/// percent.
pub(crate) const MOST_SHARE: f64 = 0.1;

/// Margin of the largest floor that dark readings allow, over the floor and over the additive noise, as both are read with an error.
/// Set by judgement.
pub(crate) const FLOOR_MARGIN: f64 = 0.1;

/// Nats by which repeats, or all readings together, must prefer turbulence to steady noise, or must speak against it to exclude it, and by which what a fit
/// leaves must prefer slow noise of the level: odds of 22,000 to one. Set by judgement.
pub(crate) static FLUCTUATION_SHOWN: DecisiveLimit = DecisiveLimit::new("fluctuation-shown", 10.0);

/// Nats by which repeats must prefer a fluctuating field for one to be tried where steady noise leaves a gap that nothing explains: odds of twenty to one.
/// Set by judgement.
pub(crate) const FLUCTUATION_POSSIBLE: f64 = 3.0;

/// Readings below which no slow noise of the level is looked for: what a fit leaves of so few follows its numbers. Set by judgement.
pub(crate) const FEWEST_FOR_SLOW_NOISE: usize = 100;

/// Largest slow noise, relative to the level: a receiver that wanders by more is at fault, and that is for a diagnosis to tell. Set by judgement.
pub(crate) const MOST_SLOW_NOISE: f64 = 0.015;

/// Nats by which repeats and dark readings may contradict the noise that all readings show, which may be a gap. Set by judgement.
pub(crate) const NOISE_AGAINST_REPEATS: f64 = 3.0;

/// Factor within which one kind of noise is looked for while the other is held, and within which dark readings fix the additive noise if
/// repeats say otherwise; and within which the noise beside a set may differ from its estimate. Set by judgement.
pub(crate) static NOISE_SEARCH_FACTOR: DecisiveLimit =
    DecisiveLimit::new("noise-search-factor", 3.0).beyond_one();

/// Equal largest readings from which on they are a full scale: four equal ones do not happen by chance.
pub(crate) const READINGS_AT_FULL_SCALE: usize = 4;

/// Deviations from the readings beside it, in those of its neighbours, from which on a reading stands out: of normal noise one in a hundred million, of a median
/// of six still one in ten thousand. Set by judgement.
pub(crate) const OUTLIER_DEVIATIONS: f64 = 6.0;

/// Share of readings that may stand out and be left out: of more, the noise is not what it seems. Set by judgement.
pub(crate) const MOST_OUTLIERS: f64 = 0.02;

/// Relative change of the noise for which a search is repeated. Set by judgement.
pub(crate) const NOISE_CHANGED: f64 = 0.04;

/// Ratio of the new proportional noise to the old, or its inverse, beyond which the first search was misled and its rejections are
/// forgotten. Set by judgement.
pub(crate) const NOISE_MISJUDGED: f64 = 0.75;

/// Rounds in which noise and effects settle together, at most. Set by judgement.
pub(crate) const NOISE_ROUNDS: usize = 2;

// Priors.

/// Standard deviation of the logarithm of a stated spread: that of the spread of some fifteen elements that were measured, 1/√(2(n - 1)) (GUM, E.4.3).
pub(crate) const SPREAD_KNOWN_WITHIN: f64 = 0.2;

/// Standard deviation of the shift that careful setting-up leaves, m: a tenth of a millimetre. A wider prior would absorb the effects
/// that move a field.
pub(crate) static SHIFT_PRIOR_M: DecisiveLimit = DecisiveLimit::new("shift-prior", 1e-4);

/// Mean and standard deviation of the share of a piston's near field that elements show: between none of it and all of it.
pub(crate) const NEAR_FIELD_PRIOR: (f64, f64) = (0.5, 0.5);

/// Standard deviation of the shift between two records of one rig, m: none. A robot that finds its origin anew by a hundredth of a
/// millimetre has moved it, and that is told as an offset.
pub(crate) const REPEATED_PLACE_M: f64 = 1e-7;

/// Standard deviation of the change of the near field between two records of one rig: it belongs to the elements and does not change.
pub(crate) const SAME_NEAR_FIELD: f64 = 1e-3;

/// Span of the natural logarithm of an effect's size in standard deviations, each order equally likely: from one to three thousand.
/// Set by judgement.
pub(crate) static EFFECT_SIZE_SPAN: DecisiveLimit = DecisiveLimit::new("effect-size-span", 8.0);

/// Span of the natural logarithm of a spread of elements, each order equally likely: from a thousandth to four tenths. Set by
/// judgement.
pub(crate) static SPREAD_SPAN: DecisiveLimit = DecisiveLimit::new("spread-span", 6.0);

/// Nats that each effect beyond the first costs: pairs are rarer than single effects, and there are 15 times as many of them (2.7
/// nats).
pub(crate) static ANOTHER_EFFECT: DecisiveLimit = DecisiveLimit::new("another-effect", 5.0);

/// Nats by which no effect is likelier beforehand than one particular effect: as a class, no effect and any one effect are about
/// equally likely (ln 33 = 3.5).
pub(crate) static NO_EFFECT: DecisiveLimit = DecisiveLimit::new("no-effect", 3.0);

// Search.

/// Cost a reading up to which a fit is near the readings: residuals 22 % larger than the noise. Set by judgement.
pub(crate) static NEAR: DecisiveLimit = DecisiveLimit::new("near", 1.5).beyond_one();

/// Single effects that are extended by another. Set by judgement.
pub(crate) const SINGLES_EXTENDED: usize = 3;

/// Larger sets that are extended, far from the readings: what two effects do not bring near a third seldom does. Set by judgement.
pub(crate) const SETS_EXTENDED: usize = 1;

/// Effects in a set at most, the simulator's own defects not counted: more imitate nearly any gap. Set by judgement.
pub(crate) const MOST_EFFECTS: usize = 3;

/// Effects in a set near the readings with which the first search, whose noise is not settled, ends. Set by judgement.
pub(crate) const ENOUGH_AT_FIRST: usize = 2;

/// Nats that a larger set must gain over the best smaller one before it is extended in its turn. Set by judgement.
pub(crate) const WORTH_EXTENDING: f64 = 2.0;

/// Rounds in which effects of the best set are exchanged for others, at most. Set by judgement.
pub(crate) const EXCHANGES: usize = 3;

/// Share of the gap in chi-square that another effect must explain: the formulas of the effects are no better than that. Set by
/// judgement.
pub(crate) static MATERIAL: DecisiveLimit = DecisiveLimit::new("material", 3e-4);

/// Cost a reading from which on a gap is very large. Set by judgement.
pub(crate) const VERY_LARGE: f64 = 100.0;

/// Share of a very large gap that another effect must explain, down to the noise. Set by judgement.
pub(crate) const MATERIAL_OF_VERY_LARGE: f64 = 1e-3;

/// Nats within which sets near the readings are rivals: they are extended, fitted to all readings, and their discrete choices are made again. Odds
/// of 160,000 to one.
pub(crate) static RIVALS: DecisiveLimit = DecisiveLimit::new("rivals", 12.0);

/// Nats behind the best, by the estimate of the coarse fit, at which an effect is given up: the estimate is far from exact. Set by
/// judgement.
pub(crate) const GIVEN_UP: f64 = 80.0;

/// Nats by which a fit may still be short of the best set after its first steps, and be fitted to the end. Set by judgement.
pub(crate) const SHORT_AT_FIRST: f64 = 30.0;

/// Sets that are fitted to all readings, and kept, however far they are behind. Set by judgement.
pub(crate) const KEPT_IN_ANY_CASE: usize = 5;

/// Sets, beside their parts, that are fitted again to more readings without a search: twice as many as a closed loop holds against each
/// other.
pub(crate) const MOST_IN_QUESTION: usize = 16;

/// Nats that the score statistic must expect of an effect before it is fitted beside a set near the readings. Set by judgement.
pub(crate) static LEAST_EXPECTED_NATS: DecisiveLimit =
    DecisiveLimit::new("least-expected-nats", -1.0);

/// Nats by which a set may be expected to fall short of the one that it extends, by one step on all readings from its fit to few, and still be fitted
/// further. Of 290 extensions that were expected to fall shorter, one gained, by 1.4 nats.
pub(crate) const ONE_STEP_SHORT_BY: f64 = 3.0;

/// Elements up to which each may have an amplitude or a phase of its own, or be exchanged with any other, beside every set: each such fit
/// takes longer with the square of their number. Set by judgement.
pub(crate) const MOST_ELEMENTS: usize = 120;

/// The same beside the best set alone: boards of 256 elements are common.
pub(crate) const MOST_ELEMENTS_OF_ONE_SET: usize = 400;

/// Drives for each element from which on the readings tell more elements than that too, as those of calibrations do. Fewer equations than
/// unknowns are enough to tell the spread of the departures, which the evidence chooses. Set by judgement.
pub(crate) const DRIVES_FOR_EACH_ELEMENT: f64 = 0.5;

/// Nats by which the best of many starts may fall short of what their number costs and still be fitted. Set by judgement.
pub(crate) const START_SHORT_BY: f64 = 4.0;

/// How far above the highest point a reflecting plane is looked for, m: a shelf, or the frame of a robot. Set by judgement.
pub(crate) const HIGHEST_PLANE_M: f64 = 0.6;

/// How far beside what was measured a wall is looked for, m: the reach of a bench. Set by judgement.
pub(crate) const FARTHEST_WALL_M: f64 = 0.4;

/// Pairs of reading and spherical wave on which walls and objects are compared first, and the readings at least. Set by judgement.
pub(crate) const PAIRS_OF_STRAY_WAVES: usize = 6000;
pub(crate) const FEWEST_OF_STRAY_WAVES: usize = 60;

/// Nats beyond the logarithm of their number that the best of thousands of walls or places of an object must gain before one is fitted: the best of so many
/// gains that logarithm by chance. Set by judgement.
pub(crate) const BEYOND_CHANCE: f64 = 2.0;

/// Walls, and places of an object, that a fit is started with. Set by judgement.
pub(crate) const WALLS: usize = 3;
pub(crate) const OBJECTS: usize = 3;

/// Planes that a fit is started with. Set by judgement.
pub(crate) const PLANES: usize = 6;

/// Periods of an axis that a fit is started with. Set by judgement.
pub(crate) const PERIODS: usize = 3;

/// Elements in a small set at most, by the catalogue.
pub(crate) const MOST_IN_A_SMALL_SET: usize = 3;

/// Of this many elements one more may be in a set of a large array. Set by judgement: with more of them faulty, nobody would measure an array before it is
/// repaired.
const ELEMENTS_FOR_A_FAULT: usize = 12;

/// Elements in a set at most, of an array of so many.
pub(crate) fn most_in_a_set(elements: usize) -> usize {
    MOST_IN_A_SMALL_SET.max(elements / ELEMENTS_FOR_A_FAULT)
}

/// Numbers of phase steps whose zeros are chosen again on all readings. Set by judgement.
pub(crate) const STEPS_REFINED: usize = 6;

/// Sets of elements that are extended by one element more. Set by judgement.
pub(crate) const SET_BEAM: usize = 40;

/// Steps of a fit in a row after which the derivatives are carried along and not computed: they hardly change from one step to the next, and
/// each costs a field. Every step is tested on the residuals themselves. Set by judgement.
pub(crate) const CARRIED: usize = 3;

/// Departures, in spreads of the others, from which on an element stands out: one of 80 does by chance.
pub(crate) const OUTSTANDING: f64 = 2.5;

/// Elements that stand out and are looked at, at most. Set by judgement.
pub(crate) const MOST_OUTSTANDING: usize = 4;

/// Correlation with the believed field below which a scan without a pose is unlike it. Set by judgement.
pub(crate) const UNLIKE: f64 = 0.5;

/// Correlation with the believed field above which a scan with a pose is like it. Set by judgement.
pub(crate) const ALIKE: f64 = 0.8;

// All effects at once.

/// Width of the prior of an effect in a joint fit to begin with, in scales of its parameters: of a departure that a scan shows well. The
/// evidence moves it. Set by judgement.
pub(crate) const FIRST_WIDTH: f64 = 20.0;

/// Rounds in which the widths of the priors settle, at most. Set by judgement.
pub(crate) const ROUNDS_OF_WIDTHS: usize = 8;

/// Rounds in which a set of many effects is extended by what has no slope, and reduced, and how many sets are exchanged from, at most. Set by judgement.
pub(crate) const JOINT_ROUNDS: usize = 4;

/// Steps by exchanges towards a better subset of effects, at most. Set by judgement.
pub(crate) const MOST_CLIMBS: usize = 10;

/// Sets found by exchanges that are fitted in a round, beside one without each effect. Set by judgement.
pub(crate) const MOST_EXCHANGES: usize = 6;

/// Nats that the quadratic form of a fit gives an effect, from which on the readings are not fitted again without it: an effect of a few numbers costs
/// some five to ten.
pub(crate) const UNQUESTIONED: f64 = 40.0;

// Residual structure.

/// Standard deviations at which a test for patterns fails: thousands of readings show small flaws of the formulas at three.
pub(crate) static PATTERN_LIMIT: DecisiveLimit = DecisiveLimit::new("pattern-limit", 4.0);

/// The same of a test that asks for one cause and knows how rare its statistic is: one in two thousand.
pub(crate) static SINGLE_CAUSE_LIMIT: DecisiveLimit = DecisiveLimit::new("single-cause-limit", 3.3);

/// The same for order among departures of elements, which no formula makes: one in four hundred, by either of two tests.
pub(crate) const ORDER_LIMIT: f64 = 3.0;

/// Rounding error of a converter, in deviations of the noise, from which on the noise does not hide it: that of steps as wide as the noise. Of
/// finer ones it is one more part of the noise, uniform and of no structure, to better than a millionth (B. Widrow and I. Kollár, *Quantization
/// Noise*, 2008, chapter 9).
pub(crate) const ROUNDING_LIMIT: f64 = 0.29;

/// Shortest period of an error along an axis that is looked for, m: about half a wavelength at 40 kHz.
pub(crate) const SHORTEST_LEAD_M: f64 = 4.5e-3;

/// Longest period of an error along an axis that is looked for, m: longer ones are hardly seen in a scan of 70 mm. Set by judgement.
pub(crate) const LONGEST_LEAD_M: f64 = 25e-3;

/// Share of a direction's power that may be in how readings scatter: the score test is one of means. Set by judgement.
pub(crate) const MOST_OF_SCATTER: f64 = 1e-3;

/// Share of a direction that the fitted effects cannot imitate, below which the test says nothing. Set by judgement.
pub(crate) const IMITATED: f64 = 0.01;

/// Fewest elements whose order says anything: up to five shapes are asked for. Set by judgement.
pub(crate) const FEWEST_ELEMENTS: usize = 12;

/// How far beside the array a wave may seem to come from, m: the image in a wall 13 cm away.
pub(crate) const FARTHEST_SOURCE_M: f64 = 0.26;

/// Distance from a plane of readings within which the robot would have touched an object, m: about the radius of a receiver. Set by
/// judgement.
pub(crate) const TOUCHED_M: f64 = 6e-3;

/// Readings below which equal distances between them may be chance. Set by judgement.
pub(crate) const FEWEST_FOR_STEPS: usize = 100;

/// Share of the least noise below which a difference of readings is the record's own last digit. Set by judgement.
pub(crate) const LAST_DIGIT: f64 = 1e-2;

/// Share of a step by which readings may miss it, for the record's last digit. Set by judgement.
pub(crate) const MISSED_STEP: f64 = 0.1;

// Change between two records.

/// Pairs of readings at common places below which a change is not diagnosed: with fewer, the elements of an array of 36 are not told apart.
pub(crate) const FEWEST_PAIRS: usize = 60;

/// Pairs that a diagnosis of a change works on at most, so that an alarm has its cause in seconds. Set by judgement.
pub(crate) const MOST_PAIRS: usize = 5000;

/// Readings of the first record to which its model is fitted at most. Set by judgement.
pub(crate) const READINGS_OF_COMMON: usize = 2500;

/// Spread of the elements' amplitudes, and of their phases in rad, in the model of the first record: large beside what arrays have, so that
/// the readings decide.
pub(crate) const COMMON_SPREADS: [f64; 2] = [0.2, 0.3];

/// Effects that may be added to the model of the first record. Set by judgement.
pub(crate) const MOST_ADDED_TO_COMMON: usize = 2;

/// Decrease of the cost a reading for which one is added. Set by judgement.
pub(crate) const WORTH_ADDING_TO_COMMON: f64 = 0.02;

/// Squared residual a reading, in units of its noise, that the model of the first record may leave, and its signatures still be those of the array. With
/// the thesis's lobes in place of pistons it leaves 19 on the virtual rig's record, and a faster sound was named as pitch and scale of an axis. Set by
/// judgement.
pub(crate) const FAR_MODEL: f64 = 9.0;

/// Effects in a change at most: between two records one thing changes, seldom two.
pub(crate) const MOST_CHANGES: usize = 2;

/// Elements of which the departure of one alone is fitted. Set by judgement.
pub(crate) const ELEMENTS_TRIED: usize = 3;

/// Share to which the amplitude of an element is known from the model of A; an element that lost all but this is dead. Of 15 dead elements
/// in the virtual rig's records, one had 2 % too little by its departure.
pub(crate) const ELEMENT_KNOWN: f64 = 0.04;

/// Share of a change that may be left with structure: the signature of an effect is as good as the model of the first record. Set by
/// judgement.
pub(crate) const SIGNATURE_SHARE: f64 = 0.02;

/// Nats by which no change is likelier beforehand than one particular change, beyond [`NO_EFFECT`]: of many records of one rig, nearly all are
/// like the one before. With three nats in all, one of 12 pairs of the virtual rig's records without a change was given one (3.2 standard
/// errors). A change of half a standard deviation has hundreds.
pub(crate) const UNCHANGED: f64 = 6.0;

/// Mean squared difference in units of its variance below which two records are copies of each other, and tests of their differences say
/// nothing: of 60 pairs with noise of their own it is below a half once in 2000 (by the distribution of χ²).
pub(crate) const COPIES: f64 = 0.5;

/// Standard errors from which on a change of the level is told: of normal noise one in 16,000.
pub(crate) const LEVEL_SIGMA: f64 = 4.0;

/// Share of a change that another effect must explain: the elements' own departures are known to some percent. Set by judgement.
pub(crate) const MATERIAL_OF_CHANGE: f64 = 0.01;

// Verdict.

/// Probability above which a set is named alone, with the larger sets that hold it, and that rivals must reach together. Set by judgement.
pub(crate) static CERTAIN: DecisiveLimit = DecisiveLimit::new("certain", 0.9).short_of_one();

/// Probability that a set must have by itself to be named for larger sets that hold it: it is likelier than not that nothing else acts.
pub(crate) static SUFFICES_ALONE: DecisiveLimit = DecisiveLimit::new("suffices-alone", 0.5);

/// Rivals that are named at most, by the contract of the output.
pub(crate) const MOST_RIVALS: usize = 3;

/// Results of tests over their limits from which on a set of many effects is given up, before effects are exchanged, and after that, while the noise may
/// still be that of a set of few: more small effects may yet be found, which leave less structure. Set by judgement.
pub(crate) const STRUCTURE_BEFORE_EXCHANGES: f64 = 3.0;
pub(crate) const STRUCTURE_AFTER_EXCHANGES: f64 = 1.5;

/// Share of the excess chi-square that the common part of rivals of many effects must explain to be named: the larger part. By the meaning of "mostly".
pub(crate) const LEAST_SHARE_OF_MOST: f64 = 0.5;

/// Share of the excess chi-square that one effect may leave and still explain a gap: no formula is better. Set by judgement.
pub(crate) static RESIDUAL_SHARE: DecisiveLimit = DecisiveLimit::new("residual-share", 3e-3);

/// Cost a reading of the believed set-up from which on a gap is so large that a formula's own error may show. Set by judgement.
pub(crate) const LARGE: f64 = 4.0;

/// Explained chi-square a reading below which a gap is faint: 0.4 standard deviations squared. Of faint gaps in a thousand sealed
/// scans thirteen were attributed to two effects or three, and none had two. Of a set-up with stated uncertainty, what its departures cost counts too.
pub(crate) static FAINT: DecisiveLimit = DecisiveLimit::new("faint", 0.16);

/// Share of a gap that rounding errors must make up to count against an explanation. Set by judgement.
pub(crate) const ROUNDING_SHARE: f64 = 0.1;

/// Share of a gap that is immaterial: rivals of three effects that differ by it are named by their common part. Set by judgement.
pub(crate) const IMMATERIAL: f64 = 2e-3;

/// Side of the blocks of points that are kept out of the fit together, wavelengths, where a scan is wide enough: between points that are
/// fitted a wavelength away, a field of many free elements is interpolated well whether or not it is understood. On a measured field of 256
/// fitted elements a fifth of the points left 6 % in blocks of one wavelength and 13 % in blocks of four.
pub(crate) const HELD_OUT_BLOCK_WAVELENGTHS: f64 = 4.0;

/// Blocks along the longest side of a narrower scan, so that a fifth of them can be kept out.
pub(crate) const HELD_OUT_BLOCKS_ACROSS: f64 = 5.0;

/// Share of the squared gap beyond noise that pose and lobe leave in held-out blocks, above which the elements explain most of it: half. On simulated planes of 36
/// unequal elements it was 0.5 to 1, of 121 that were told by few readings 0.25; beside sound elements a reflection, a wall and an object left more with the elements than without.
pub(crate) const LEAST_BY_ELEMENTS: f64 = 0.5;

/// Mean square that pose and lobe leave of held-out blocks, over that of the noise, below which elements have nothing to explain. Set by judgement.
pub(crate) const LEAST_FOR_ELEMENTS: f64 = 2.0;

/// Standard deviations by which two effects, or two sets, are separated.
pub(crate) const SEPARATED_SIGMA: f64 = 3.0;

/// The variance of a reading, over that of the scan's scatter, is kept above this: no detector is as quiet as a formula.
pub(crate) const LEAST_VARIANCE_RATIO: f64 = 1e-3;

/// Nats against a floor where dark readings could have shown one and did not. Set by judgement.
pub(crate) const FLOOR_NOT_SEEN: f64 = 4.0;

/// Probability that the cause is none of those that were looked at, though nothing in the readings says so: of 273 sealed scans whose
/// first candidate had all the evidence for it, two had another cause, or one more that was too small to see.
pub(crate) const ANOTHER_CAUSE: f64 = 0.02;

/// Probability that a set of more than [`MOST_EFFECTS`] effects, or a part of one, holds an effect that is not there, though the evidence asks for it: it
/// imitates others that were not compared. Of 21 benches of development sets for which such a set was named, five had one.
pub(crate) const IMITATED_AMONG_MANY: f64 = 0.25;

/// Candidates that a report lists: one line each on a screen.
pub(crate) const MOST_CANDIDATES: usize = 12;

/// Half-angles of the receiver beyond this one, degrees, are not determined and told as this one, without an error: a receiver that looks at
/// the array hears nothing from behind.
pub(crate) const MOST_HALF_ANGLE_DEG: f64 = 90.0;
