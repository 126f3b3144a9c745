//! The pressures under a set of effects: the measurement chain from the drive to the receiver's face.
//!
//! The field is p(x) = Σ wₙ gₙ(x) exp(i k dₙ) over the elements n, as the acoustics crate sums it. Each effect changes one or more links
//! of the chain before or after that sum; see [`Effect`](super::effect::Effect). Effects act in the order of the catalogue, except on
//! the place of the receiver: there the position is followed from the robot's own reading to the array's frame, which is the catalogue
//! backwards.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::f64::consts::TAU;

use num_complex::Complex64;

use fieldgap_acoustics::transducer::{Shaped, Transducer, Widened};
use fieldgap_acoustics::{
    Array, FieldKernel, FieldSum, PathLengths, Propagation, Simulation, Simulator, Vec3, delays_s,
};

use super::effect::{Carrier, Context, Radiation, Stage, SurroundingField, Timing};
use super::instance::{Active, Instance};
use super::mirror::Mirror;
use super::nuisance::Nuisance;
use super::observations::{Driven, Observations, ObservedDrive, Visit};
use super::pressure::Pressure;
use super::waves::Waves;
use crate::effect_id::EffectId;

/// The believed set-up with some effects added.
#[derive(Clone)]
pub(crate) struct ForwardModel<'c> {
    /// In the order in which they were added.
    added: Vec<Active<'c>>,
    /// Their numbers in that order, sorted by the catalogue.
    sorted: Vec<usize>,
    /// Numbers of those that act in amplifier and detector, sorted by the catalogue.
    detector: Vec<usize>,
    changes_scatter: bool,
    scatters_field: bool,
    clips: bool,
    depends_on_arrival: bool,
    couples: bool,
    drifts: bool,
    /// Factor on the speed of sound at the moment for which the field is computed.
    speed_ratio: f64,
}

/// Turn of the phases from one moment to the next at most, rad, of which the paths share most: half way between two the interpolated mean is short by an
/// eighth of the square of the rest.
const TURN_RAD: f64 = 0.1;

/// Moments at most.
const MOST_MOMENTS: usize = 64;

/// Pressures of every reading: by scan, then drive, then visit. Where it matters how the robot arrived, those of the visits outside of rows
/// follow after them, with the other motion.
pub(crate) type Pressures = Vec<Vec<Vec<Pressure>>>;

impl<'c> ForwardModel<'c> {
    /// The believed set-up, nothing added.
    pub fn believed() -> Self {
        Self::with(Vec::new())
    }

    /// A set of effects, each with its values, beside those that are known from another record.
    pub fn of(instances: &[Instance], values: &[Vec<f64>], context: &'c Context) -> Self {
        let active = instances.iter().zip(values);
        let active = active.map(|(instance, values)| Active::new(instance, values, context));
        Self::of_active(active, context)
    }

    /// These effects, beside those that are known from another record.
    pub fn of_active(active: impl Iterator<Item = Active<'c>>, context: &'c Context) -> Self {
        let common = context.common.iter().flat_map(|common| &common.effects);
        let common = common.map(|(instance, values)| Active::new(instance, values, context));
        Self::with(common.chain(active).collect())
    }

    /// The same beside departures of the set-up within its stated uncertainty.
    pub fn beside_departures(
        instances: &[Instance],
        values: &[Vec<f64>],
        departures: &BTreeMap<EffectId, Vec<f64>>,
        context: &'c Context,
    ) -> Self {
        let stated = context.stated.beside(instances);
        let stated = stated
            .filter_map(|departure| Some((&departure.instance, departures.get(&departure.id())?)));
        let all = stated.chain(instances.iter().zip(values));
        let active = all.map(|(instance, values)| Active::new(instance, values, context));
        Self::of_active(active, context)
    }

    /// The same and one more effect.
    pub fn and(&self, instance: &Instance, values: &[f64], context: &'c Context) -> Self {
        let mut added = self.added.clone();
        added.push(Active::new(instance, values, context));
        Self::with(added)
    }

    /// The same without the effects that make a reading differ from its own repeat.
    pub fn without_fluctuations(&self) -> Self {
        let kept = self.added.iter().filter(|active| !active.effect.scatters_repeats());
        Self::with(kept.cloned().collect())
    }

    fn with(added: Vec<Active<'c>>) -> Self {
        let mut sorted: Vec<usize> = (0..added.len()).collect();
        sorted.sort_by_key(|&number| added[number].effect.id());
        let at_stage = |stage: Stage| {
            let of_stage = |number: &usize| added[*number].effect.facts().stage == stage;
            sorted.iter().copied().filter(of_stage).collect::<Vec<_>>()
        };
        let scatters = |active: &Active<'_>| active.effect.changes_scatter(active.setting());
        let is_of_moment = |active: &Active<'_>| {
            let facts = active.effect.facts();
            facts.stage == Stage::Field && facts.timing == Timing::Moment
        };
        let arrival = |active: &Active<'_>| active.effect.facts().timing.is_of_arrival();
        Self {
            detector: at_stage(Stage::Detector),
            changes_scatter: added.iter().any(scatters),
            scatters_field: added
                .iter()
                .any(|active| active.effect.facts().stage == Stage::Field && scatters(active)),
            clips: !at_stage(Stage::Converter).is_empty(),
            couples: added.iter().any(|active| active.effect.couples()),
            drifts: added.iter().any(|active| is_of_moment(active) && !active.is_neutral()),
            speed_ratio: 1.0,
            depends_on_arrival: added.iter().any(|active| arrival(active) && !active.is_neutral()),
            sorted,
            added,
        }
    }

    /// The effects, in the order of the catalogue.
    pub(crate) fn effects(&self) -> impl DoubleEndedIterator<Item = &Active<'c>> {
        self.sorted.iter().map(|&number| &self.added[number])
    }

    /// The effects, in the order in which they were added.
    pub(crate) fn as_added(&self) -> &[Active<'c>] {
        &self.added
    }

    /// The effects of amplifier and detector, in the order of the catalogue.
    pub(crate) fn detector(&self) -> impl Iterator<Item = &Active<'c>> {
        self.detector.iter().map(|&number| &self.added[number])
    }

    /// Whether readings scatter otherwise than the scan's scatter says.
    pub fn changes_scatter(&self) -> bool {
        self.changes_scatter
    }

    /// Whether the field itself differs from reading to reading.
    pub fn scatters_field(&self) -> bool {
        self.scatters_field
    }

    /// Whether the converter cuts readings.
    pub fn clips(&self) -> bool {
        self.clips
    }

    /// Whether it matters how the robot arrived at a point.
    pub fn depends_on_arrival(&self) -> bool {
        self.depends_on_arrival
    }

    /// Speed of sound and frequency.
    pub fn carrier(&self) -> Carrier {
        let mut carrier = Carrier { speed_ratio: self.speed_ratio, frequency_ratio: 1.0 };
        self.effects().for_each(|active| active.effect.carrier(active.setting(), &mut carrier));
        carrier
    }

    /// The wavenumber, rad/m.
    pub fn wavenumber_rad_m(&self, believed: &Simulation) -> f64 {
        let carrier = self.carrier();
        believed.medium.wavenumber_rad_m(believed.frequency_hz) * carrier.frequency_ratio
            / carrier.speed_ratio
    }

    /// Where the receiver truly is, array's frame, m.
    pub fn place(&self, visit: &Visit) -> Vec3 {
        self.effects()
            .rev()
            .fold(visit.at_m, |at_m, active| active.effect.position(active.setting(), visit, at_m))
    }

    /// Where the receiver truly is at each visit, array's frame, m.
    pub fn places(&self, visits: &[Visit], nuisance: &Nuisance) -> Vec<Vec3> {
        visits.iter().map(|visit| self.place(visit) + nuisance.shift_m).collect()
    }

    /// The pressures of all readings.
    pub fn pressures(&self, observations: &Observations, nuisance: &[Nuisance]) -> Pressures {
        let scans = observations.scans.iter().zip(nuisance);
        scans
            .map(|(scan, nuisance)| {
                let drives = scan.drives.iter().map(|drive| (drive.driven(), drive));
                self.of_each_drive(drives, nuisance, |chain, driven, drive| {
                    self.pressures_of(chain, driven, &self.visits(drive))
                })
            })
            .collect()
    }

    /// What the chain of each of these drives of one scan gives. Drives that differ in their phases alone share what they have in common.
    fn of_each_drive<'d, D, O>(
        &'d self,
        drives: impl IntoIterator<Item = (Driven<'d>, D)>,
        nuisance: &'d Nuisance,
        of: impl Fn(&Chain<'d, 'c>, Driven<'d>, D) -> O,
    ) -> Vec<O> {
        let mut before: Option<Chain<'d, 'c>> = None;
        let of_drive = |(driven, data): (Driven<'d>, D)| {
            let chain = match before.take() {
                Some(chain) if chain.differs_in_phases_from(driven) => chain.driven(driven),
                _ => Chain::of(self, driven, nuisance),
            };
            of(before.insert(chain), driven, data)
        };
        drives.into_iter().map(of_drive).collect()
    }

    /// The visits of a drive and, where it matters how the robot arrived, those outside of rows again with the other motion.
    pub fn visits<'d>(&self, drive: &'d ObservedDrive) -> Cow<'d, [Visit]> {
        if !self.depends_on_arrival {
            return Cow::Borrowed(&drive.visits);
        }
        let mut visits = drive.visits.clone();
        let other = |visit: &Visit| Some(Visit { motion: visit.otherwise?, ..*visit });
        visits.extend(drive.visits.iter().filter_map(other));
        Cow::Owned(visits)
    }

    /// The pressure at each visit of one drive, with the shift and the near field of its scan.
    pub fn pressures_at<'d>(
        &self,
        driven: impl Into<Driven<'d>>,
        visits: &[Visit],
        nuisance: &Nuisance,
    ) -> Vec<Pressure> {
        let driven = driven.into();
        self.pressures_of(&Chain::of(self, driven, nuisance), driven, visits)
    }

    fn pressures_of<'d>(
        &self,
        chain: &Chain<'d, '_>,
        driven: Driven<'d>,
        visits: &[Visit],
    ) -> Vec<Pressure> {
        if self.drifts {
            return self.pressures_on_the_way(chain.nuisance, driven, visits);
        }
        let points_m = self.places(visits, chain.nuisance);
        let scattered = self.effects().find_map(|active| {
            active
                .effect
                .scattered_position(active.setting(), &points_m, &|at_m| chain.pressures(at_m))
        });
        scattered.unwrap_or_else(|| chain.pressures(&points_m))
    }

    /// The pressures of readings between which the air changes: interpolated between moments so near to each other that the phases of the paths turn
    /// by [`TURN_RAD`] from one to the next.
    fn pressures_on_the_way<'d>(
        &self,
        nuisance: &'d Nuisance,
        driven: Driven<'d>,
        visits: &[Visit],
    ) -> Vec<Pressure> {
        let ratio_at = |visit: &Visit| -> f64 {
            let effects = self.effects();
            effects
                .map(|active| active.effect.speed_ratio_at(active.setting(), visit.time_s))
                .product()
        };
        let ratios: Vec<f64> = visits.iter().map(ratio_at).collect();
        let least = ratios.iter().copied().fold(f64::INFINITY, f64::min);
        let most = ratios.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let farthest_m = visits.iter().map(|visit| visit.at_m.norm()).fold(0.0, f64::max);
        let turn_rad = self.wavenumber_rad_m(driven.believed) * farthest_m * (most - least);
        let moments = ((turn_rad / TURN_RAD).ceil() as usize).clamp(1, MOST_MOMENTS);
        let step = ((most - least) / moments as f64).max(f64::MIN_POSITIVE);
        let moment_of = |ratio: f64| (((ratio - least) / step) as usize).min(moments - 1);
        let mut found: Vec<Option<Pressure>> = vec![None; visits.len()];
        for moment in 0..moments {
            let indices: Vec<usize> =
                (0..visits.len()).filter(|&i| moment_of(ratios[i]) == moment).collect();
            let some: Vec<Visit> = indices.iter().map(|&i| visits[i]).collect();
            let [before, after] = [moment, moment + 1].map(|edge| {
                let speed_ratio = least + step * edge as f64;
                let model = Self { speed_ratio, drifts: false, ..self.clone() };
                model.pressures_of(&Chain::of(&model, driven, nuisance), driven, &some)
            });
            for ((&i, before), after) in indices.iter().zip(before).zip(after) {
                // What is common to all paths turns about as that from the array's centre, and is not interpolated.
                let to_centre_rad = |ratio: f64| {
                    self.wavenumber_rad_m(driven.believed) * visits[i].at_m.norm() / ratio
                };
                let [before_rad, after_rad] =
                    [moment, moment + 1].map(|edge| to_centre_rad(least + step * edge as f64));
                let share = (ratios[i] - least) / step - moment as f64;
                let between = before.turned(-before_rad).towards(&after.turned(-after_rad), share);
                found[i] = Some(between.turned(to_centre_rad(ratios[i])));
            }
        }
        found.into_iter().map(|pressure| pressure.expect("each has a moment")).collect()
    }

    /// What each element adds to the coherent pressure at each visit: by drive of one scan, then element, then visit.
    pub fn contributions<'d>(
        &'d self,
        drives: &'d [ObservedDrive],
        nuisance: &'d Nuisance,
    ) -> Vec<Vec<Vec<Complex64>>> {
        let drives = drives.iter().map(|drive| (drive.driven(), drive));
        self.of_each_drive(drives, nuisance, |chain, _, drive| {
            chain.waves.contributions_at(&self.places(&self.visits(drive), nuisance))
        })
    }

    /// The field of the array's images in a plane, if it reflects all of it, at points of each of these drives of one scan.
    pub fn images<'d>(
        &self,
        drives: impl IntoIterator<Item = (Driven<'d>, Vec<Vec3>)>,
        mirror: &Mirror,
        nuisance: &Nuisance,
    ) -> Vec<Complex64> {
        let mut images = Vec::new();
        let mut before: Option<(Chain<'_, '_>, Waves)> = None;
        for (driven, points_m) in drives {
            let (chain, of_images) = match before.take() {
                Some((chain, of_images)) if chain.differs_in_phases_from(driven) => {
                    let chain = chain.driven(driven);
                    let of_images = of_images.driven(chain.waves.phases_rad().to_vec());
                    (chain, of_images)
                }
                _ => {
                    let chain = Chain::of(self, driven, nuisance);
                    let of_images = chain.mirrored(mirror);
                    (chain, of_images)
                }
            };
            images.extend(of_images.at(&points_m));
            before = Some((chain, of_images));
        }
        images
    }

    /// Whether no effect makes the receiver's sensitivity depend on the angle of arrival.
    fn hears_from_all_sides(&self) -> bool {
        let turns =
            |active: &Active<'_>| active.effect.sensitivity(active.setting(), 1.0).is_some();
        !self.effects().any(turns)
    }

    /// How many spherical waves make up the field: one of each element, or one of each patch of a face.
    pub fn waves_of_all(&self, context: &Context) -> usize {
        let believed = &context.believed;
        let (transducer, wavenumber) =
            (self.radiation(believed).transducer, self.wavenumber_rad_m(believed));
        let elements = believed.array.elements();
        let of_one = |radius_m: f64| transducer.patches(radius_m, wavenumber).len();
        elements.first().map_or(0, |element| elements.len() * of_one(element.radius_m))
    }

    /// The field of the elements at points of each of these drives of one scan.
    pub fn fields<'d>(
        &'d self,
        drives: impl IntoIterator<Item = (Driven<'d>, &'d [Vec3])>,
        nuisance: &'d Nuisance,
    ) -> Vec<Complex64> {
        self.of_each_drive(drives, nuisance, |chain, _, points_m| chain.waves.at(points_m)).concat()
    }

    /// What each element is driven with, rad.
    pub fn phases_rad<'d>(&self, driven: impl Into<Driven<'d>>) -> Vec<f64> {
        let Driven { believed, number } = driven.into();
        let carrier = self.carrier();
        let frequency_hz = believed.frequency_hz;
        let delays_s =
            delays_s(&believed.excitation, &believed.array, &believed.medium, frequency_hz);
        // Delays are kept in seconds, whatever the carrier, also those that make given phases.
        let mut phases_rad: Vec<f64> = delays_s
            .into_iter()
            .map(|delay_s| TAU * frequency_hz * carrier.frequency_ratio * delay_s)
            .collect();
        // The driver rounds delays before its outputs are routed to the elements: the catalogue backwards.
        for active in self.effects().rev() {
            active.effect.drive_phases(active.setting(), number, &carrier, &mut phases_rad);
        }
        phases_rad
    }

    /// Relative change of one element's complex amplitude from this model to another.
    pub fn change_of_element(&self, element: usize, other: &Self) -> Complex64 {
        other.weight_of_element(element) / self.weight_of_element(element) - 1.0
    }

    /// Factor on one element's complex amplitude by its departures.
    pub fn weight_of_element(&self, element: usize) -> Complex64 {
        self.effects().map(|active| active.element_weight(element)).product()
    }

    /// The elements, and the phases that they are driven with, rad.
    fn sources(&self, driven: Driven<'_>) -> (Array, Vec<f64>) {
        let mut elements = driven.believed.array.elements().to_vec();
        let phases_rad = self.phases_rad(driven);
        for active in self.effects() {
            active.effect.elements(active.setting(), &mut elements);
            active.effect.coupled(active.setting(), &phases_rad, &mut elements);
        }
        let array = Array::from_elements(elements).expect("as many elements as are believed");
        (array, phases_rad)
    }

    fn believed_paths(believed: &Simulation) -> PathLengths {
        match (believed.simulator, believed.excitation.focus_m()) {
            (Simulator::AsWritten, Some(focus_m)) => PathLengths::FrozenAt(focus_m.z),
            _ => PathLengths::Observed,
        }
    }

    fn radiation<'b>(&self, believed: &'b Simulation) -> Radiation<'b> {
        let paths = Self::believed_paths(believed);
        let transducer = believed.transducer();
        let mut radiation = Radiation {
            transducer,
            width_ratio: 1.0,
            by_face: false,
            shape: [0.0; 2],
            on_axis: None,
            paths,
        };
        self.effects().for_each(|active| active.effect.radiation(active.setting(), &mut radiation));
        radiation
    }

    fn air(&self, believed: &Simulation) -> Propagation {
        let speed_m_s = believed.medium.speed_of_sound_m_s * self.carrier().speed_ratio;
        let mut air = Propagation::default();
        self.effects().for_each(|active| active.effect.air(active.setting(), speed_m_s, &mut air));
        air
    }

    fn waves(
        &self,
        believed: &Simulation,
        array: &Array,
        phases_rad: Vec<f64>,
        nuisance: &Nuisance,
    ) -> Waves {
        let wavenumber = self.wavenumber_rad_m(believed);
        let Radiation { transducer, width_ratio, by_face, shape, on_axis, paths } =
            self.radiation(believed);
        let widened = Widened { transducer, ratio: width_ratio, by_face };
        let shaped = Shaped { transducer: &widened, shape };
        let lobe: &dyn Transducer = if shape == [0.0; 2] { &widened } else { &shaped };
        let mut kernel = FieldKernel::new(array, &phases_rad, lobe, wavenumber, paths);
        if let Some(on_axis) = on_axis {
            kernel = kernel.with_on_axis(on_axis);
        }
        kernel = kernel.with_propagation(self.air(believed)).with_near_field(nuisance.near_field);
        let lobes: Vec<_> = self
            .effects()
            .filter_map(|active| active.effect.sensitivity(active.setting(), wavenumber))
            .collect();
        if !lobes.is_empty() {
            let sensitivity =
                |angle_rad| -> f64 { lobes.iter().map(|lobe| lobe(angle_rad)).product() };
            kernel = kernel.with_receiver_directivity(sensitivity);
        }
        Waves::of(kernel, phases_rad)
    }
}

/// The chain of one drive, ready to be sampled at any points.
struct Chain<'m, 'c> {
    model: &'m ForwardModel<'c>,
    believed: &'m Simulation,
    nuisance: &'m Nuisance,
    array: Array,
    waves: Waves,
}

impl<'m, 'c> Chain<'m, 'c> {
    fn of(model: &'m ForwardModel<'c>, driven: Driven<'m>, nuisance: &'m Nuisance) -> Self {
        let (array, phases_rad) = model.sources(driven);
        let waves = model.waves(driven.believed, &array, phases_rad, nuisance);
        Self { model, believed: driven.believed, nuisance, array, waves }
    }

    /// Whether another drive differs from this one in its phases alone.
    fn differs_in_phases_from(&self, other: Driven<'_>) -> bool {
        if self.model.couples {
            return false;
        }
        let (one, other) = (self.believed, other.believed);
        one.simulator == other.simulator
            && one.medium == other.medium
            && one.frequency_hz == other.frequency_hz
            && ForwardModel::believed_paths(one) == ForwardModel::believed_paths(other)
            && one.array == other.array
    }

    /// The chain of a drive that differs in its phases alone. (The lobes of a kernel take longer to prepare than to be summed at a few points.)
    fn driven(self, driven: Driven<'m>) -> Self {
        let waves = self.waves.driven(self.model.phases_rad(driven));
        Self { believed: driven.believed, waves, ..self }
    }

    fn pressures(&self, points_m: &[Vec3]) -> Vec<Pressure> {
        let mut pressures = self.of_elements(points_m);
        let around = Around { chain: self, points_m };
        for active in self.model.effects() {
            active.effect.added_waves(active.setting(), &around, &mut pressures);
        }
        pressures
    }

    fn of_elements(&self, points_m: &[Vec3]) -> Vec<Pressure> {
        let attenuated = |attenuation_np_m: f64| -> Vec<FieldSum> {
            let air = self.model.air(self.believed);
            let attenuation_np_m = air.attenuation_np_m + attenuation_np_m;
            let air = Propagation { attenuation_np_m, ..air };
            self.waves.kernel().clone().with_propagation(air).sums_at(points_m)
        };
        let scintillating = self
            .model
            .effects()
            .find_map(|active| active.effect.scintillating(active.setting(), &attenuated));
        scintillating
            .unwrap_or_else(|| self.waves.at(points_m).into_iter().map(Pressure::steady).collect())
    }

    /// The waves of the images in a plane.
    fn mirrored(&self, mirror: &Mirror) -> Waves {
        self.waves.moved(|place| mirror.of_place(place), |axis| mirror.of_direction(axis))
    }
}

/// The field around some points.
struct Around<'a, 'm, 'c> {
    chain: &'a Chain<'m, 'c>,
    points_m: &'a [Vec3],
}

impl SurroundingField for Around<'_, '_, '_> {
    fn points_m(&self) -> &[Vec3] {
        self.points_m
    }

    fn wavenumber_rad_m(&self) -> f64 {
        self.chain.model.wavenumber_rad_m(self.chain.believed)
    }

    fn images(&self, mirror: &Mirror) -> Vec<Complex64> {
        // The field of the images is that of the elements at the image of each point, if the receiver hears from all sides.
        if self.chain.model.hears_from_all_sides() {
            let points_m: Vec<Vec3> =
                self.points_m.iter().map(|at_m| mirror.of_place(at_m)).collect();
            return self.chain.waves.at(&points_m);
        }
        self.chain.mirrored(mirror).at(self.points_m)
    }

    fn waves_at(&self, at_m: &Vec3) -> Vec<(Vec3, Complex64)> {
        let places = self.chain.array.elements().iter().map(|element| element.centre_m);
        let waves = self.chain.waves.contributions_at(std::slice::from_ref(at_m));
        places.zip(waves.into_iter().map(|wave| wave[0])).collect()
    }
}
