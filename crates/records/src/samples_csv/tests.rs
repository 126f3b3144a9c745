use proptest::prelude::*;

use super::*;

const HEADER: &str = "time_s,focus,x_mm,y_mm,z_mm,reading\n";

fn read(text: &str) -> Result<(Columns, Vec<RecordedSample>), Fault> {
    samples_of(&Table::new(Path::new("samples.csv"), text), &limits())
}

/// Two foci, and readings in volts.
fn limits() -> SampleLimits {
    SampleLimits { foci: 2, readings: ReadingRange::of("V"), phase: true }
}

fn fault(text: &str) -> Fault {
    read(text).expect_err("the table has a fault")
}

#[test]
fn rows_are_read_in_their_order() {
    let (columns, samples) =
        read(&format!("{HEADER}-8.0,-1,0,0,150,0.0019\n0.5,1,-35,-35.5,50,0.25\n")).expect("good");
    assert_eq!(columns, Columns::PLAIN);
    assert_eq!(samples[0].focus, None);
    assert_eq!(samples[1].focus, Some(1));
    assert_eq!(samples[1].position_m(), Vec3::new(-0.035, -0.0355, 0.05));
    assert_eq!((samples[1].time_s, samples[1].reading), (0.5, 0.25));
}

#[test]
fn every_kind_of_bad_row_is_placed_at_its_cell() {
    let cases = [
        ("0.1,0,1,2,3,oops", (3, 13), "`oops`"),
        ("0.1,0,1,2,3,NaN", (3, 13), "finite"),
        ("0.1,0,1,inf,3,1", (3, 9), "y_mm"),
        ("0.1,0,1,2,3,-0.5", (3, 13), "`-0.5`"),
        ("0.1,0,1,2,3,1e7", (3, 13), "a voltage of at most 1000000 V"),
        ("0.1,2,1,2,3,1", (3, 5), "2 [[focus]]"),
        ("0.1,-2,1,2,3,1", (3, 5), "focus -2"),
        ("0.1,0.5,1,2,3,1", (3, 5), "`0.5`"),
        ("0.1,0,1,2,3", (3, 12), "5 cells"),
        ("0.1,0,1,2,3,1,9", (3, 15), "7 cells"),
        ("0.1,0,1,,3,1", (3, 9), "empty"),
    ];
    for (row, place, said) in cases {
        let fault = fault(&format!("{HEADER}0,0,0,0,0,1\n{row}\n"));
        assert_eq!(fault.line_column(), Some(place), "{row}: {fault}");
        assert!(fault.problem().contains(said), "{row}: {fault}");
        assert!(fault.to_string().starts_with("samples.csv:3:"), "{fault}");
    }
}

#[test]
fn a_wrong_header_is_placed_at_the_first_wrong_name() {
    let fault = fault("time_s,focus,x_m,y_mm,z_mm,reading\n");
    assert_eq!(fault.line_column(), Some((1, 14)));
    assert!(read("").is_err());
}

#[test]
fn spread_is_read_and_checked() {
    let header = "time_s,focus,x_mm,y_mm,z_mm,reading,std,count\n";
    let (columns, samples) = read(&format!("{header}0,0,1,2,3,0.5,0.01,16\n")).expect("good");
    assert_eq!(columns, Columns::WITH_SPREAD);
    assert_eq!(samples[0].spread, Some(Spread { std: 0.01, count: 16 }));
    for bad in ["0,0,1,2,3,0.5,-0.01,16", "0,0,1,2,3,0.5,0.01,0", "0,0,1,2,3,0.5,0.01,1.5"] {
        assert!(read(&format!("{header}{bad}\n")).is_err(), "{bad}");
    }
}

#[test]
fn a_phase_is_read_from_its_column_or_from_two_parts() {
    let polar = "time_s,focus,x_mm,y_mm,z_mm,reading,std,count,phase_rad\n\
                 0,0,1,2,3,0.5,0.01,16,-2.5\n1,0,1,2,3,0.5,0.01,16,\n";
    let (columns, samples) = read(polar).expect("good");
    assert_eq!(columns, Columns::WITH_SPREAD.with_phase());
    assert_eq!([samples[0].phase_rad, samples[1].phase_rad], [Some(-2.5), None]);
    let parts = "time_s,focus,x_mm,y_mm,z_mm,re,im,std,count\n0,0,1,2,3,-3,4,0.01,16\n";
    let (_, samples) = read(parts).expect("good");
    assert_eq!(samples[0].reading, 5.0);
    // cos φ = -3/5 and sin φ = 4/5.
    assert!((samples[0].phase_rad.expect("a phase") - (-0.6f64).acos()).abs() < 1e-15);
    assert_eq!(samples[0].spread, Some(Spread { std: 0.01, count: 16 }));
}

#[test]
fn every_kind_of_bad_phase_is_placed_at_its_cell() {
    let cases = [
        ("reading,phase_rad", "0.5,NaN", (2, 15), "finite"),
        ("reading,phase_rad", "0.5,inf", (2, 15), "phase_rad"),
        ("reading,phase_rad", "0.5,x", (2, 15), "`x`"),
        ("reading,phase_rad", ",1.5", (2, 11), "empty"),
        ("reading,phase_rad", "0.5", (2, 14), "6 cells"),
        ("re,im", "0.5,", (2, 15), "empty"),
        ("re,im", ",0.5", (2, 11), "empty"),
        ("re,im", "0.5,NaN", (2, 15), "finite"),
        ("re,im", "-8e5,7e5", (2, 11), "a voltage of at most 1000000 V"),
    ];
    for (columns, cells, place, said) in cases {
        let text = format!("time_s,focus,x_mm,y_mm,z_mm,{columns}\n0,0,1,2,3,{cells}\n");
        let fault = fault(&text);
        assert_eq!(fault.line_column(), Some(place), "{cells}: {fault}");
        assert!(fault.problem().contains(said), "{cells}: {fault}");
    }
}

#[test]
fn a_phase_of_unknown_meaning_is_neither_read_nor_written() {
    let unknown = SampleLimits { phase: false, ..limits() };
    for columns in ["reading,phase_rad", "re,im"] {
        let text = format!("time_s,focus,x_mm,y_mm,z_mm,{columns}\n0,0,1,2,3,0.5,1\n");
        let fault = samples_of(&Table::new(Path::new("samples.csv"), text.as_str()), &unknown);
        assert!(fault.expect_err("no [phase]").problem().contains("what a phase means"));
    }
    let phased =
        RecordedSample::measured(0.0, None, Vec3::zeros(), 0.5, None).with_phase(Some(1.0));
    assert!(write_samples(&mut Vec::new(), &[phased], &unknown).is_err());
    assert!(write_samples(&mut Vec::new(), &[phased], &limits()).is_ok());
}

#[test]
fn a_file_cut_anywhere_but_at_a_line_end_is_a_fault_on_its_last_line() {
    let whole = format!("{HEADER}0.25,0,1.5,2.5,100.0,0.75\n0.5,1,3.5,2.5,100.0,0.125\n");
    for cut in 1..whole.len() {
        let cut_text = &whole[..cut];
        match read(cut_text) {
            Ok((_, samples)) => {
                assert!(cut_text.ends_with('\n'));
                assert_eq!(samples.len() + 1, cut_text.lines().count());
            }
            Err(fault) => {
                let (line, _) = fault.line_column().expect("placed");
                assert_eq!(line, cut_text.lines().count(), "cut at {cut}: {fault}");
            }
        }
    }
}

#[test]
fn samples_with_and_without_spread_do_not_go_into_one_file() {
    let plain = RecordedSample::measured(0.0, None, Vec3::zeros(), 0.0, None);
    let spread = RecordedSample { spread: Some(Spread { std: 0.0, count: 1 }), ..plain };
    let error = write_samples(&mut Vec::new(), &[plain, spread], &limits()).expect_err("mixed");
    assert_eq!(error.kind(), io::ErrorKind::InvalidInput);
}

#[test]
fn what_the_reader_would_refuse_is_not_written() {
    let good = RecordedSample::measured(0.0, None, Vec3::zeros(), 0.5, None);
    let spread = |std, count| Some(Spread { std, count });
    let bad = [
        RecordedSample { time_s: f64::INFINITY, ..good },
        RecordedSample { position_mm: Vec3::new(0.0, f64::NAN, 0.0), ..good },
        RecordedSample { reading: f64::NAN, ..good },
        RecordedSample { reading: -1e-9, ..good },
        RecordedSample { reading: 1e7, ..good },
        RecordedSample { focus: Some(2), ..good },
        RecordedSample { phase_rad: Some(f64::NAN), ..good },
        RecordedSample { spread: spread(-0.1, 1), ..good },
        RecordedSample { spread: spread(f64::NAN, 1), ..good },
        RecordedSample { spread: spread(0.1, 0), ..good },
    ];
    for sample in bad {
        let written = write_samples(&mut Vec::new(), &[sample], &limits());
        assert!(written.is_err(), "{sample:?}");
    }
    assert!(write_samples(&mut Vec::new(), &[good], &limits()).is_ok());
}

fn any_number() -> impl Strategy<Value = f64> {
    use proptest::num::f64::{NEGATIVE, NORMAL, POSITIVE, SUBNORMAL, ZERO};
    (POSITIVE | NEGATIVE | NORMAL | SUBNORMAL | ZERO).prop_map(|number| number % 1e4)
}

fn any_magnitude() -> impl Strategy<Value = f64> {
    any_number().prop_map(f64::abs)
}

prop_compose! {
    fn any_sample()(
        time_s in any_number(),
        focus in prop::option::of(0usize..2),
        at in [any_number(), any_number(), any_number()],
        reading in any_magnitude(),
        std in any_magnitude(),
        count in 1u32..,
        phase_rad in prop::option::of(any_number()),
    ) -> RecordedSample {
        let spread = Some(Spread { std, count });
        RecordedSample { time_s, focus, position_mm: Vec3::from(at), reading, phase_rad, spread }
    }
}

proptest! {
    #[test]
    fn what_is_written_reads_back_to_the_last_bit(
        mut samples in prop::collection::vec(any_sample(), 0..6),
        with_spread: bool,
        with_phase: bool,
    ) {
        if !with_phase {
            samples.iter_mut().for_each(|sample| sample.phase_rad = None);
        }
        if !with_spread {
            samples.iter_mut().for_each(|sample| sample.spread = None);
        }
        let mut bytes = Vec::new();
        write_samples(&mut bytes, &samples, &limits()).expect("all alike");
        let text = String::from_utf8(bytes).expect("text");
        let (columns, again) = read(&text).expect("what was written reads");
        prop_assert_eq!(columns, Columns::of(&samples));
        prop_assert!(with_phase || !text.contains("phase"));
        // Debug shows the shortest digits and the sign of zero: equal text is equal bits.
        prop_assert_eq!(format!("{samples:?}"), format!("{again:?}"));
    }

    #[test]
    fn no_text_makes_the_reader_panic(text in "(time_s,focus,x_mm,y_mm,z_mm,(reading|reading,phase_rad|re,im)\n)?[-0-9.,eNa\r\n λ\"]{0,60}") {
        let _ = read(&text);
    }
}
