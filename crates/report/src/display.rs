//! The pictures of a tactile display, moving and still, and its frames as a table.

use std::path::{Path, PathBuf};

use super::error::ReportError;
use super::folder::Folder;
use super::picture::{DisplayMap, DisplayPanel, Drawn, animated};
use fieldgap_acoustics::PlaneGrid;
use fieldgap_acoustics::radiation::SkinInAir;
use fieldgap_display::{ComposedDisplay, DisplayFile, Playback};

/// Shorter loops are shown slower, s.
const SHORTEST_S: f64 = 2.0;

/// Longer loops are shown faster, s.
const LONGEST_S: f64 = 8.0;

/// A display with its field.
pub struct PlayedDisplay<'a> {
    /// The file.
    pub display: &'a DisplayFile,
    /// The frames that are sent.
    pub composed: &'a ComposedDisplay,
    /// The field of each frame.
    pub playback: &'a Playback<'a>,
    /// The reflecting skin.
    pub skin: SkinInAir,
    /// Frequency of the carrier, Hz.
    pub carrier_hz: f64,
}

/// The files of a display.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DisplayFiles {
    /// The moving picture, an animated PNG.
    pub animation: PathBuf,
    /// The maximum sound pressure and the mean radiation pressure, over time.
    pub still: PathBuf,
    /// The position of the foci in every frame, and the sound pressure there.
    pub frames: PathBuf,
}

/// Writes the pictures of a display and its frames into a folder, which is created if it is missing.
///
/// # Errors
/// [`ReportError`] if a picture cannot be drawn or a file cannot be written.
pub fn write_display(dir: &Path, shown: &PlayedDisplay) -> Result<DisplayFiles, ReportError> {
    let pictures_of_loop = Pictures::new(shown);
    let folder = Folder::make(dir)?;
    let moving = pictures_of_loop.moving()?;
    let still = pictures_of_loop.still()?;
    Ok(DisplayFiles {
        animation: folder.put("display-moving.png", &moving)?,
        still: folder.put("display.png", &still.png)?,
        frames: folder.put("frames.csv", shown.table().as_bytes())?,
    })
}

impl PlayedDisplay<'_> {
    fn table(&self) -> String {
        let mut table =
            "frame,begins_ms,holds_ms,focus,x_mm,y_mm,z_mm,pressure_pa_rms\n".to_owned();
        let a_period_ms = 1e3 / self.carrier_hz;
        for (frame, slot) in self.composed.slots.iter().enumerate() {
            let begins_ms = self.composed.program.begins(frame) as f64 * a_period_ms;
            let holds_ms = f64::from(slot.periods.get()) * a_period_ms;
            for (focus, at_m) in &slot.foci {
                let at_mm = at_m * 1e3;
                let pressure = self.playback.rms_pa(frame, &[*at_m])[0];
                table += &format!(
                    "{frame},{begins_ms:.4},{holds_ms:.4},{focus},{:.4},{:.4},{:.4},{pressure:.3}\n",
                    at_mm.x, at_mm.y, at_mm.z
                );
            }
        }
        table
    }
}

/// The pictures of one loop.
struct Pictures<'a> {
    shown: &'a PlayedDisplay<'a>,
    grid: PlaneGrid,
    /// The periods of the carrier that are drawn.
    periods: Vec<u64>,
    /// Duration of the loop, s.
    loop_s: f64,
    /// Whether the foci stand still and only the envelope changes.
    by_envelope: bool,
    paths_mm: Vec<Vec<(f64, f64)>>,
}

impl<'a> Pictures<'a> {
    fn new(shown: &'a PlayedDisplay<'a>) -> Self {
        let picture = &shown.display.picture;
        let first_m = shown.composed.slots[0].foci[0].1;
        let z_m = picture.z_mm.map_or(first_m.z, |z_mm| z_mm.get() * 1e-3);
        let grid =
            PlaneGrid::square(0.5e-3 * picture.size_mm.get(), 1e-3 * picture.step_mm.get(), z_m);
        let program = &shown.composed.program;
        let by_envelope = program.frames().len() == 1;
        let whole = match by_envelope {
            // One cycle of the envelope is enough to see it.
            true => {
                shown.composed.modulation_hz.map_or(1, |hz| (shown.carrier_hz / hz).round() as u64)
            }
            false => program.loop_periods(),
        };
        let most = u64::from(picture.frames.get());
        let count = match by_envelope {
            true => whole.min(most),
            false => (program.frames().len() as u64).min(most),
        };
        // A movement of fewer frames than pictures is shown frame by frame, whatever each lasts.
        let periods = (0..count.max(1))
            .map(|n| match by_envelope || program.frames().len() as u64 > most {
                true => whole * n / count.max(1),
                false => program.begins(n as usize),
            })
            .collect();
        let foci = shown.display.focus.len();
        let mut paths_mm = vec![Vec::new(); foci];
        for slot in &shown.composed.slots {
            for (focus, at_m) in &slot.foci {
                paths_mm[*focus].push((at_m.x * 1e3, at_m.y * 1e3));
            }
        }
        for path in &mut paths_mm {
            // Every path is closed.
            path.extend(path.first().copied());
        }
        let loop_s = whole as f64 / shown.carrier_hz;
        Self { shown, grid, periods, loop_s, by_envelope, paths_mm }
    }

    fn pressures(&self) -> Vec<Vec<f64>> {
        let points = self.grid.points();
        let playback = self.shown.playback;
        self.periods
            .iter()
            .map(|&period| {
                let level = if self.by_envelope { playback.envelope_at(period) } else { 1.0 };
                let frame = self.shown.composed.program.frame_at(period);
                playback.rms_pa(frame, &points).into_iter().map(|pa| pa * level).collect()
            })
            .collect()
    }

    fn moving(&self) -> Result<Vec<u8>, ReportError> {
        let pressures = self.pressures();
        let top = pressures.iter().flatten().copied().fold(0.0, f64::max);
        let pictures: Vec<DisplayMap> = pressures
            .into_iter()
            .zip(&self.periods)
            .filter_map(|(values, &period)| {
                let slot = &self.shown.composed.slots[self.shown.composed.program.frame_at(period)];
                let time_ms = period as f64 / self.shown.carrier_hz * 1e3;
                let time = if self.loop_s < 0.1 {
                    format!("{time_ms:.3} ms")
                } else {
                    format!("{:.3} s", time_ms * 1e-3)
                };
                let shown = DisplayPanel {
                    title: format!("{}, {time}", self.shown.display.name),
                    label: "sound pressure (Pa rms)".to_owned(),
                    values,
                    top,
                    foci_mm: slot
                        .foci
                        .iter()
                        .map(|(_, at_m)| (at_m.x * 1e3, at_m.y * 1e3))
                        .collect(),
                };
                DisplayMap::new(&self.grid, vec![shown], self.paths_mm.clone())
            })
            .collect();
        let each_s = self.loop_s.clamp(SHORTEST_S, LONGEST_S) / pictures.len().max(1) as f64;
        Ok(animated(&pictures, (each_s * 1e3).round().clamp(20.0, 2000.0) as u16)?)
    }

    /// The maximum over all frames, and their mean, weighted by the time that each is held.
    fn still(&self) -> Result<Drawn, ReportError> {
        let PlayedDisplay { composed, playback, skin, .. } = self.shown;
        let points = self.grid.points();
        let program = &composed.program;
        let envelope = program.envelope();
        let share = (0..envelope.loop_periods())
            .step_by(envelope.hold_periods().get() as usize)
            .map(|period| playback.envelope_at(period).powi(2))
            .sum::<f64>()
            / envelope.levels().len() as f64;
        let mut largest = vec![0.0f64; points.len()];
        let mut mean = vec![0.0; points.len()];
        for (frame, slot) in composed.slots.iter().enumerate() {
            let held = f64::from(slot.periods.get()) / program.loop_periods() as f64;
            for (n, pa) in playback.rms_pa(frame, &points).into_iter().enumerate() {
                largest[n] = largest[n].max(pa);
                mean[n] += held * share * skin.radiation_pressure_pa(pa);
            }
        }
        let top = |values: &[f64]| values.iter().copied().fold(0.0, f64::max);
        let z_mm = self.grid.z_m * 1e3;
        let maps = vec![
            DisplayPanel {
                title: format!(
                    "{}, maximum over time at z = {z_mm:.0} mm",
                    self.shown.display.name
                ),
                label: "sound pressure (Pa rms)".to_owned(),
                top: top(&largest),
                values: largest,
                foci_mm: Vec::new(),
            },
            DisplayPanel {
                title: "on skin, mean over time".to_owned(),
                label: "radiation pressure (Pa)".to_owned(),
                top: top(&mean),
                values: mean,
                foci_mm: Vec::new(),
            },
        ];
        let map = DisplayMap::new(&self.grid, maps, self.paths_mm.clone())
            .expect("a square about the axis has a point");
        Ok(Drawn::new(&map)?)
    }
}
