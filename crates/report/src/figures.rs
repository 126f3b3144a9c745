//! The pictures of a report, and the names of their files.

use rayon::prelude::*;

use super::figure::Figure;
use super::judgement::drives;
use super::picture::{
    Drawn, HeightCurves, HologramMaps, PhaseMap, PictureError, PlaneMaps, PrintStyle,
};
use fieldgap_comparison::Comparison;
use fieldgap_text::height_mm;

/// All pictures of a report.
pub(super) struct Figures {
    /// Every plane against every simulator: by drive, then height, then simulator.
    pub planes: Vec<PlaneFigure>,
    /// The phases of the planes that have them, in the same order.
    pub phases: Vec<PhaseFigure>,
    /// Curves against height, one for each drive that has several heights.
    pub curves: Vec<Figure>,
}

/// The maps of a plane of a comparison.
pub(super) struct PlaneFigure {
    /// Index of the comparison.
    pub comparison: usize,
    /// Index of the plane in it.
    pub plane: usize,
    /// The maps; `None` where the plane has none.
    pub picture: Option<Figure>,
}

/// The phases of a plane of a comparison.
pub(super) struct PhaseFigure {
    /// Index of the comparison.
    pub comparison: usize,
    /// Index of the plane in it.
    pub plane: usize,
    /// The map of differences.
    pub map: Figure,
    /// The plane brought back to the elements, where it was.
    pub hologram: Option<Figure>,
}

impl Figures {
    /// Draws them all, as they are to be printed.
    pub fn draw(comparisons: &[Comparison], style: PrintStyle) -> Result<Self, PictureError> {
        let several_drives = comparisons.iter().any(|comparison| drives(comparison).len() > 1);
        let drive_name =
            |drive: usize| if several_drives { format!("-drive{drive}") } else { String::new() };
        let mut places: Vec<(usize, usize)> = comparisons
            .iter()
            .enumerate()
            .flat_map(|(index, comparison)| {
                (0..comparison.planes.len()).map(move |plane| (index, plane))
            })
            .collect();
        let plane_at = |(comparison, plane): (usize, usize)| &comparisons[comparison].planes[plane];
        places.sort_by(|&a, &b| {
            let (plane_a, plane_b) = (plane_at(a), plane_at(b));
            let drive = plane_a.focus.cmp(&plane_b.focus);
            drive.then(plane_a.z_m.total_cmp(&plane_b.z_m)).then(a.cmp(&b))
        });
        let planes = places
            .par_iter()
            .map(|&(index, number)| {
                let (comparison, plane) = (&comparisons[index], plane_at((index, number)));
                let name = format!(
                    "map{}-z{}mm-{}",
                    drive_name(plane.focus),
                    height_mm(plane.z_m).replace('\u{2212}', "-"),
                    comparison.simulator
                );
                let maps = PlaneMaps::new(plane, comparison.simulator, &comparison.reading_unit);
                let picture = match maps {
                    Some(maps) => {
                        let narrow = Drawn::new(&maps.clone().stacked())?;
                        let drawn = Drawn::printed(maps, style)?;
                        Some(Figure::new(name, drawn).with_narrow(narrow))
                    }
                    None => None,
                };
                Ok(PlaneFigure { comparison: index, plane: number, picture })
            })
            .collect::<Result<Vec<_>, PictureError>>()?;
        let phases = places
            .par_iter()
            .filter_map(|&(index, number)| {
                let (comparison, plane) = (&comparisons[index], plane_at((index, number)));
                let map = PhaseMap::new(plane, comparison.simulator)?;
                let name = |kind: &str| {
                    let height = height_mm(plane.z_m).replace('\u{2212}', "-");
                    let drive = drive_name(plane.focus);
                    format!("{kind}{drive}-z{height}mm-{}", comparison.simulator)
                };
                let hologram = plane.phase.as_ref()?.hologram.as_ref();
                let hologram = hologram.and_then(|hologram| {
                    HologramMaps::new(hologram, comparison.simulator, &comparison.reading_unit)
                });
                let draw = || {
                    let hologram = hologram.map(|maps| Drawn::printed(maps, style)).transpose()?;
                    Ok(PhaseFigure {
                        comparison: index,
                        plane: number,
                        map: Figure::new(name("phase"), Drawn::printed(map, style)?),
                        hologram: hologram.map(|drawn| Figure::new(name("elements"), drawn)),
                    })
                };
                Some(draw())
            })
            .collect::<Result<Vec<_>, PictureError>>()?;
        let curves = comparisons
            .first()
            .map(drives)
            .unwrap_or_default()
            .into_iter()
            .filter_map(|drive| Some((drive, HeightCurves::new(comparisons, drive)?)))
            .map(|(drive, curves)| {
                let name = format!("curves{}", drive_name(drive));
                Ok(Figure::new(name, Drawn::printed(curves, style)?))
            })
            .collect::<Result<Vec<_>, PictureError>>()?;
        Ok(Self { planes, phases, curves })
    }

    /// Every picture.
    pub fn all(&self) -> impl Iterator<Item = &Figure> {
        let of_phases =
            self.phases.iter().flat_map(|phase| [Some(&phase.map), phase.hologram.as_ref()]);
        let planes = self.planes.iter().map(|plane| plane.picture.as_ref());
        planes.chain(of_phases).flatten().chain(&self.curves)
    }
}
