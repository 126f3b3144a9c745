//! What a file of points is asked for: which columns, in which units.

use std::str::FromStr;

use crate::unit::{AngleUnit, LengthUnit, ReadingUnit, UnknownUnit};

/// The columns of the places and of the readings, by name or number.
#[derive(Debug, Clone, PartialEq)]
pub struct Columns {
    /// Names of the columns of x, y and z.
    pub place: [Source; 3],
    /// Names of the column of the reading, or of the two columns of a complex reading.
    pub reading: Vec<String>,
}

/// Where a coordinate comes from.
#[derive(Debug, Clone, PartialEq)]
pub enum Source {
    /// A column or a variable.
    Column(String),
    /// One value for all points, written as `=100`.
    Constant(f64),
}

/// The columns cannot be those of points.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum WrongColumns {
    /// Not four or five.
    #[error(
        "{0} columns are named; x, y, z and the reading are expected, or x, y, z and the two parts of a complex reading"
    )]
    Count(usize),
    /// A constant that is no number.
    #[error("`{0}` is not a number after the =")]
    Constant(String),
    /// A constant reading.
    #[error("`{0}`: a reading cannot be a constant")]
    ConstantReading(String),
}

impl FromStr for Columns {
    type Err = WrongColumns;

    fn from_str(text: &str) -> Result<Self, WrongColumns> {
        let names: Vec<&str> = text.split(',').map(str::trim).collect();
        let [x, y, z, reading @ ..] = &names[..] else {
            return Err(WrongColumns::Count(names.len()));
        };
        if !(1..=2).contains(&reading.len()) {
            return Err(WrongColumns::Count(names.len()));
        }
        if let Some(constant) = reading.iter().find(|name| name.starts_with('=')) {
            return Err(WrongColumns::ConstantReading((*constant).to_owned()));
        }
        let source = |name: &str| match name.strip_prefix('=') {
            None => Ok(Source::Column(name.to_owned())),
            Some(number) => match number.trim().parse::<f64>() {
                Ok(value) if value.is_finite() => Ok(Source::Constant(value)),
                _ => Err(WrongColumns::Constant(name.to_owned())),
            },
        };
        Ok(Self {
            place: [source(x)?, source(y)?, source(z)?],
            reading: reading.iter().map(|name| (*name).to_owned()).collect(),
        })
    }
}

/// The units of the columns.
#[derive(Debug, Clone, PartialEq)]
pub struct Units {
    /// Of x, y and z.
    pub place: [LengthUnit; 3],
    /// Of the reading.
    pub reading: ReadingUnit,
    /// Of the phase, if the reading is an amplitude and a phase.
    pub phase: Option<AngleUnit>,
}

/// The units cannot be those of points.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum WrongUnits {
    /// One is not known.
    #[error(transparent)]
    Unknown(#[from] UnknownUnit),
    /// Not four or five.
    #[error(
        "{0} units are named; those of x, y, z and the reading are expected, such as mm,mm,mm,V"
    )]
    Count(usize),
    /// The reading is a phase.
    #[error(
        "the unit of the reading is that of a phase; the amplitude comes first, as in mm,mm,mm,V,rad"
    )]
    OnlyPhase,
    /// The two parts of a complex reading have units that do not belong together.
    #[error(
        "the units of the two parts of a complex reading are the same (re,im), or the second is rad or deg (amplitude,phase); decibels have \
         no real part"
    )]
    Parts,
}

impl Units {
    /// Takes units as texts: those of x, y, z, of the reading and of its second part.
    ///
    /// # Errors
    /// [`WrongUnits`].
    pub fn of(texts: &[&str]) -> Result<Self, WrongUnits> {
        let [x, y, z, reading @ ..] = texts else {
            return Err(WrongUnits::Count(texts.len()));
        };
        let place = [x.parse()?, y.parse()?, z.parse()?];
        let unit = |text: &str| text.parse::<ReadingUnit>();
        match reading {
            [one] => match unit(one)? {
                ReadingUnit::Phase(_) => Err(WrongUnits::OnlyPhase),
                reading => Ok(Self { place, reading, phase: None }),
            },
            [one, two] => match (unit(one)?, unit(two)?) {
                (ReadingUnit::Phase(_), _) => Err(WrongUnits::OnlyPhase),
                (reading, ReadingUnit::Phase(phase)) => {
                    Ok(Self { place, reading, phase: Some(phase) })
                }
                (reading @ ReadingUnit::Linear(_), other) if reading == other => {
                    Ok(Self { place, reading, phase: None })
                }
                _ => Err(WrongUnits::Parts),
            },
            _ => Err(WrongUnits::Count(texts.len())),
        }
    }
}

impl FromStr for Units {
    type Err = WrongUnits;

    fn from_str(text: &str) -> Result<Self, WrongUnits> {
        Self::of(&text.split(',').collect::<Vec<_>>())
    }
}

/// What is done with negative readings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Negative {
    /// They are refused with an explanation.
    #[default]
    Refuse,
    /// Their sign is removed.
    Rectify,
    /// They are left out and counted.
    LeaveOut,
}

/// The order of the dimensions of an array of readings, as `z,y,x`: 0 is x, 1 is y, 2 is z.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Order(pub Vec<usize>);

impl FromStr for Order {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let axes: Option<Vec<usize>> = text
            .split(',')
            .map(|axis| ["x", "y", "z"].iter().position(|known| *known == axis.trim()))
            .collect();
        let wrong = || {
            "expected the axes of the array from the first dimension on, such as z,y,x".to_owned()
        };
        let axes = axes.ok_or_else(wrong)?;
        let repeated = (0..axes.len()).any(|index| axes[..index].contains(&axes[index]));
        if repeated { Err(wrong()) } else { Ok(Self(axes)) }
    }
}

/// What a file of points is asked for.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PointsRequest {
    /// The columns; without them the columns of the file are listed in the error.
    pub columns: Option<Columns>,
    /// The units; without them those that the file states.
    pub units: Option<Units>,
    /// Column of the times, seconds; without it the order of the file is kept.
    pub time: Option<String>,
    /// Column of the number of the drive, -1 for a silent array; without it all readings belong to `focus`.
    pub drive: Option<String>,
    /// Number of the drive, if there is no column for it.
    pub focus: usize,
    /// Columns of the standard deviation, in the unit of the readings, and of the count of the single readings.
    pub spread: Option<[String; 2]>,
    /// What is done with negative readings.
    pub negative: Negative,
    /// Whether phases are kept: the record says what they mean.
    pub phase: bool,
    /// The order of the dimensions of an array of readings.
    pub order: Option<Order>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_names_numbers_or_constants() {
        let columns: Columns = "x, y,=100,p".parse().expect("four");
        assert_eq!(columns.place[2], Source::Constant(100.0));
        assert_eq!(columns.reading, ["p"]);
        assert_eq!("1,2,3,re,im".parse::<Columns>().expect("five").reading.len(), 2);
        for wrong in ["x,y,z", "x,y,z,a,b,c", "x,y,=a,p", "x,y,z,=1", "x,y,=inf,p"] {
            assert!(wrong.parse::<Columns>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn units_of_complex_readings_belong_together() {
        for good in ["mm,mm,mm,V", "m,m,m,mV,mV", "mm,mm,mm,dB:1V,deg", "um,um,um,Pa,rad"] {
            good.parse::<Units>().expect(good);
        }
        for wrong in ["mm,mm,mm", "mm,mm,mm,rad", "mm,mm,mm,V,mV", "mm,mm,mm,dB,dB", "mm,mm,mm,mm"]
        {
            assert!(wrong.parse::<Units>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn an_order_names_each_axis_once() {
        assert_eq!("z,y,x".parse(), Ok(Order(vec![2, 1, 0])));
        assert!("z,z,x".parse::<Order>().is_err() && "zyx".parse::<Order>().is_err());
    }
}
