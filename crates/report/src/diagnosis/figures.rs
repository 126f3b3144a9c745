//! The pictures of the report of a diagnosis, and the names of their files.

use rayon::prelude::*;

use super::super::figure::Figure;
use super::super::picture::{Drawn, PictureError, ResidualMaps};
use super::waterfall;
use fieldgap_diagnosis::{DiagnosedPlane, Diagnosis};
use fieldgap_text::fixed;

/// All pictures of a diagnosis.
pub(super) struct DiagnosisFigures {
    /// The share that each effect explains; `None` where there is nothing to explain.
    pub waterfall: Option<Figure>,
    /// The maps of each plane; `None` where its points lie on no grid.
    pub planes: Vec<Option<Figure>>,
}

impl DiagnosisFigures {
    /// Draws them all.
    pub fn draw(diagnosis: &Diagnosis) -> Result<Self, PictureError> {
        let waterfall = waterfall::chart(diagnosis).map(|chart| Drawn::new(&chart)).transpose()?;
        let planes = diagnosis
            .planes
            .par_iter()
            .map(|plane| {
                let Some(maps) = ResidualMaps::new(plane, &diagnosis.reading_unit) else {
                    return Ok(None);
                };
                let figure = Figure::new(name(diagnosis, plane), Drawn::new(&maps)?);
                Ok(Some(figure.with_narrow(Drawn::new(&maps.stacked())?)))
            })
            .collect::<Result<Vec<_>, PictureError>>()?;
        Ok(Self {
            waterfall: waterfall.map(|drawn| Figure::new("waterfall".to_owned(), drawn)),
            planes,
        })
    }

    /// Every picture.
    pub fn all(&self) -> impl Iterator<Item = &Figure> {
        std::iter::once(&self.waterfall).chain(&self.planes).flatten()
    }
}

/// The name of the file of a plane's picture, without its extension.
fn name(diagnosis: &Diagnosis, plane: &DiagnosedPlane) -> String {
    let scan =
        if diagnosis.scans.len() > 1 { format!("-scan{}", plane.scan) } else { String::new() };
    let several_drives = diagnosis.planes.iter().any(|other| other.focus != plane.focus);
    let drive = if several_drives { format!("-drive{}", plane.focus) } else { String::new() };
    let height = fixed(plane.z_mm, 3).replace('\u{2212}', "-");
    let height = height.trim_end_matches('0').trim_end_matches('.');
    format!("residual{scan}{drive}-z{height}mm")
}
