//! The numbers that explain a plane, and how widely each is thought to be spread beforehand.

use num_complex::Complex64;

use crate::limits::{ORDINARY_GAIN, ORDINARY_PHASE_RAD};

/// A kind of number that each element has of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Group {
    /// The real part of its weight about one: its gain.
    Gain,
    /// The imaginary part of its weight: its phase, or its height.
    Phase,
    /// Where it stands beside its place, m, along x and along y.
    Place,
    /// How steeply its lobe leans, along x and along y: the natural logarithm of its pressure changes by this times the direction cosine.
    Lean,
}

impl Group {
    /// All of them, in the order of the parameters.
    pub const ALL: [Self; 4] = [Self::Gain, Self::Phase, Self::Place, Self::Lean];

    /// Numbers of an element.
    pub fn size(self) -> usize {
        match self {
            Self::Gain | Self::Phase => 1,
            Self::Place | Self::Lean => 2,
        }
    }

    /// Where the search for the width begins: ordinary elements, set by hand to some tenths of a millimetre and some degrees. The fit
    /// replaces it.
    pub fn first_width(self) -> f64 {
        match self {
            Self::Gain => ORDINARY_GAIN,
            Self::Phase => ORDINARY_PHASE_RAD,
            Self::Place => 0.3e-3,
            Self::Lean => 0.2,
        }
    }
}

/// Numbers that all elements share.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shared {
    /// Shift of the scan along x, y, z, m.
    Shift(usize),
    /// Turn about z, rad.
    Turn,
    /// True step over recorded step along x, y.
    Step(usize),
    /// Slope of the plane along x, y.
    Slope(usize),
    /// How far a row scanned one way lies from one scanned the other way, along and across the travel, m.
    Travel(usize),
    /// The logarithm of the lobe beyond the simulator's, by powers of sin² θ: modulus.
    Lobe(usize),
    /// The same: phase.
    LobePhase(usize),
    /// How steeply the lobes of all lean along x, y: a receiver that is not upright.
    Lean(usize),
    /// Natural logarithm of the level.
    Level,
    /// Level with the array silent, added in power, in the rms of the readings.
    Floor,
}

impl Shared {
    /// All of them, in the order of the parameters.
    pub const ALL: [Self; 19] = [
        Self::Shift(0),
        Self::Shift(1),
        Self::Shift(2),
        Self::Turn,
        Self::Step(0),
        Self::Step(1),
        Self::Slope(0),
        Self::Slope(1),
        Self::Travel(0),
        Self::Travel(1),
        Self::Lobe(1),
        Self::Lobe(2),
        Self::Lobe(3),
        Self::LobePhase(1),
        Self::LobePhase(2),
        Self::Lean(0),
        Self::Lean(1),
        Self::Level,
        Self::Floor,
    ];

    /// How far it may lie from where the registration has it, standard deviation.
    pub fn width(self) -> f64 {
        match self {
            // A robot set by eye: millimetres, a degree, and a step known to two percent.
            Self::Shift(_) => 3e-3,
            Self::Turn | Self::Step(_) | Self::Slope(_) => 0.02,
            // The backlash of a belt or a screw.
            Self::Travel(_) => 1e-3,
            // exp(-3 sin² θ) is the lobe of a face of half a wavelength; its phase is that of the centre of curvature, which is a fraction of
            // a wavelength from the face.
            Self::Lobe(_) => 3.0,
            Self::LobePhase(_) => 0.5,
            // Three degrees of lean of a lobe exp(-3 sin² θ).
            Self::Lean(_) => 0.3,
            Self::Level | Self::Floor => 1.0,
        }
    }
}

/// Which numbers are fitted, and where they lie in the list of parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Layout {
    /// Elements.
    pub elements: usize,
    /// Kinds of numbers that are fitted element by element.
    pub groups: Vec<Group>,
    /// Whether some readings were taken on the way to and others on the way fro.
    pub has_travel: bool,
}

impl Layout {
    /// How many parameters there are.
    pub fn len(&self) -> usize {
        self.shared_at() + Shared::ALL.len()
    }

    /// Where the parameters of a group begin: one axis after the other.
    pub fn at(&self, group: Group) -> Option<usize> {
        let place = self.groups.iter().position(|other| *other == group)?;
        Some(self.groups[..place].iter().map(|group| group.size() * self.elements).sum())
    }

    /// Where the shared parameters begin.
    pub fn shared_at(&self) -> usize {
        self.groups.iter().map(|group| group.size() * self.elements).sum()
    }

    /// Where one of them lies.
    pub fn shared(&self, which: Shared) -> usize {
        let place = Shared::ALL.iter().position(|other| *other == which);
        self.shared_at() + place.expect("all are in the list")
    }

    /// The weights of the elements.
    pub fn weights(&self, x: &[f64]) -> Vec<Complex64> {
        let n = self.elements;
        (0..n).map(|k| Complex64::new(x[k], x[n + k])).collect()
    }

    /// A group's numbers of an element along x and y; zero if it is not fitted.
    pub fn pair(&self, x: &[f64], group: Group, element: usize) -> [f64; 2] {
        self.at(group)
            .map_or([0.0; 2], |at| [0, 1].map(|axis| x[at + axis * self.elements + element]))
    }

    /// The same parameters in another layout; those that it lacks are left out, and those that are new are zero.
    pub fn moved(&self, x: &[f64], to: &Self) -> Vec<f64> {
        let mut moved = vec![0.0; to.len()];
        for &group in &to.groups {
            let size = group.size() * self.elements;
            if let (Some(from), Some(into)) = (self.at(group), to.at(group)) {
                moved[into..into + size].copy_from_slice(&x[from..from + size]);
            }
        }
        let into = to.shared_at();
        moved[into..].copy_from_slice(&x[self.shared_at()..]);
        moved
    }
}
