//! The texts of the files that `init` writes.

use super::answers::{Answers, Driver, Receiver, Robot};

/// Room that the first plan leaves to the ends of the travel, mm.
const MARGIN_MM: f64 = 5.0;

/// How far the keep-out box reaches beyond the array, and how far above it, mm.
const BESIDE_MM: f64 = 20.0;
const ABOVE_MM: f64 = 15.0;

/// Whether any device is virtual.
pub(super) fn has_virtual_devices(answers: &Answers) -> bool {
    answers.robot == Robot::Virtual
        || answers.receiver == Receiver::Virtual
        || answers.driver == Driver::Virtual
}

/// A text as a TOML string.
fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}

fn port_line(port: Option<&String>) -> String {
    port.map_or("# virtual: no port\n".to_owned(), |port| format!("port = {}\n", quoted(port)))
}

/// A number with a decimal point, as TOML floats have it.
fn float(value: f64) -> String {
    format!("{:?}", (value * 1e3).round() / 1e3)
}

/// The rig file. `truth` is the file with the true field of virtual devices.
pub(super) fn rig(answers: &Answers, truth: &str) -> String {
    let [columns, rows] = answers.array;
    let [x0, x1, y0, y1, z0, z1] = answers.travel_mm.map(float);
    let [x, y, z] = answers.centre_mm;
    let half = |count: u32| 0.5 * f64::from(count) * answers.pitch_mm + BESIDE_MM;
    let (wide, high) = (half(columns), half(rows));
    let least = [x - wide, y - high, z - 50.0].map(float).join(", ");
    let most = [x + wide, y + high, z + ABOVE_MM].map(float).join(", ");
    let mut text = format!(
        "# A rig file. Check each value against your rig before anything moves.\n\
         # `fieldgap rig check` with this file talks to the devices and moves nothing.\n\n\
         name = {name}\n\n\
         [array]                             # as you believe it to be\n\
         frequency_hz = {frequency}\n\
         layout = \"square\"                   # or linear, hexagonal, random, elements\n\
         columns = {columns}\n\
         rows = {rows}\n\
         element_diameter_mm = {pitch}         # with its rim\n\
         spacing_mm = 0.0                    # gap between neighbouring rims\n\n\
         [medium]\n\
         temperature_c = {temperature}\n\
         humidity_percent = 50.0             # 50 % more change the speed of sound by 0.2 %\n\
         pressure_kpa = 101.3                # has nearly no effect on it\n\n\
         [motion]\n\
         # The array's centre, on the plane of the elements' faces, in the robot's axes: drive the receiver's tip there by\n\
         # hand, as near as is safe, and read the position.\n\
         origin_mm = [{origin}]\n\
         # Where the receiver's tip may go, in the robot's axes: not beyond the end switches.\n\
         travel_mm = {{ x = [{x0}, {x1}], y = [{y0}, {y1}], z = [{z0}, {z1}] }}\n\
         feed_mm_s = 50.0\n\
         position_tolerance_mm = 0.05\n\n\
         # The receiver's tip never enters this box: the array with its frame, larger to each side by what the receiver's holder\n\
         # sticks out.\n\
         [[motion.keep_out]]\n\
         name = \"array and its frame\"\n\
         min_mm = [{least}]\n\
         max_mm = [{most}]\n\n",
        name = quoted(&answers.name),
        frequency = float(answers.frequency_hz),
        pitch = float(answers.pitch_mm),
        temperature = float(answers.temperature_c),
        origin = answers.centre_mm.map(float).join(", "),
    );
    text += &robot(answers);
    text += &receiver(answers);
    text += &driver(answers);
    if has_virtual_devices(answers) {
        text += &virtual_section(answers, truth);
    }
    text
}

fn robot(answers: &Answers) -> String {
    let port = port_line(answers.robot_port.as_ref());
    let home = "# The path of homing is the firmware's own; no keep-out box is checked on it. Home first the axis that clears the\n\
                # array, for instance:\n";
    match answers.robot {
        Robot::Virtual => format!("[motion.marlin]\n{port}\n"),
        Robot::Marlin => format!(
            "[motion.marlin]\n{port}baud = 115200\n{home}# home = [\"G28 Z\", \"G28 X Y\"]\n\n"
        ),
        Robot::Grbl => format!(
            "[motion.grbl]\n{port}baud = 115200\n{home}# home = [\"$HZ\", \"$HX\", \"$HY\"]\n\n"
        ),
        Robot::Klipper => {
            format!("[motion.klipper]\n{port}{home}# home = [\"G28 Z\", \"G28 X Y\"]\n\n")
        }
        Robot::Auto => format!("[motion.auto]\n{port}baud = 115200\n\n"),
    }
}

fn receiver(answers: &Answers) -> String {
    let port = port_line(answers.receiver_port.as_ref());
    let common = "[receiver]\n\
                  settle_ms = 50.0                    # after standstill: let the holder stop swinging\n\
                  samples = 16                        # readings averaged at a point\n\n";
    let own = match answers.receiver {
        Receiver::Virtual => format!("[receiver.stream]\n{port}encoding = \"binary\"\n"),
        Receiver::Stream => {
            format!("[receiver.stream]\n{port}baud = 921600\nencoding = \"binary\"\n")
        }
        Receiver::FreeRunning => format!(
            "[receiver.free-running]             # lines of time in microseconds and value\n{port}baud = 115200\n\
             rate_hz = 500.0                     # adapt: lines a second\n\
             unit = \"V\"\n\
             full_scale = 5.0                    # adapt: where its converter clips\n\
             latency_ms = 60.0                   # adapt: the longest time from a sample to its arrival here\n"
        ),
        Receiver::Scpi => format!(
            "[receiver.scpi]\naddress = {}\ndialect = \"rigol\"                   # or siglent, keysight\nchannel = 1\n",
            quoted(answers.receiver_port.as_deref().unwrap_or_default())
        ),
    };
    format!("{common}{own}\n")
}

fn driver(answers: &Answers) -> String {
    let port = port_line(answers.driver_port.as_ref());
    let common = "[focus_array]\n\
                  modulation_hz = 0.0                 # a continuous wave; 200 Hz can be felt\n\
                  modulation_duty_percent = 100.0\n\n";
    let own = match answers.driver {
        Driver::Virtual => format!("[focus_array.thesis]\n{port}"),
        Driver::Thesis => format!("[focus_array.thesis]\n{port}baud = 115200\n"),
        Driver::SonicSurface => format!("[focus_array.sonic_surface]\n{port}boards = 1\n"),
        Driver::Ultraino => format!("[focus_array.ultraino]\n{port}model = \"mega\"\nboards = 1\n"),
    };
    format!("{common}{own}\n")
}

fn virtual_section(answers: &Answers, truth: &str) -> String {
    let [x0, x1, y0, y1, z0, z1] = answers.travel_mm;
    let lengths = [x1 - x0, y1 - y0, z1 - z0].map(float).join(", ");
    let all = answers.robot == Robot::Virtual
        && answers.receiver == Receiver::Virtual
        && answers.driver == Driver::Virtual;
    let pace = match all {
        true => "pace = \"lockstep\"                   # as fast as the computer can",
        false => {
            "pace = { times = 1.0 }              # real devices beside it: as fast as they are"
        }
    };
    format!(
        "[virtual]                           # the devices above without a port\n\
         seed = 1\n{pace}\n\
         truth = {}\n\n\
         [virtual.robot]\n\
         travel_mm = [{lengths}]\n",
        quoted(truth)
    )
}

/// Sensitivity of the virtual microphone in the field of 36 elements, V/Pa: the focus has two thirds of the converter's full scale.
const SENSITIVITY_V_PA: f64 = 0.003;

/// What the virtual devices are really like. A larger array is louder, and its microphone less sensitive, so that nothing is clipped.
pub(super) fn truth(answers: &Answers) -> String {
    let elements: f64 = answers.array.map(f64::from).iter().product();
    let sensitivity = SENSITIVITY_V_PA * (36.0 / elements).min(1.0);
    format!(
        "# What the virtual laboratory is really like: the elements' faces radiate as pistons, and readings are a little noisy.\n\n\
     [source]\n\
     pressure_pa_at_1_m = 4.0\n\
     face_radius_mm = 4.5\n\n\
     [microphone]\n\
     sensitivity_v_pa = {sensitivity:.6}\n\n\
     [noise]\n\
     multiplicative = 0.01                 # of each sample's level\n\
     additive_v = 0.015\n\n\
     # A cause of a gap, to try `fieldgap diagnose` on:\n\
     # [effects.sound-speed]\n\
     # c_m_s = 347.1\n"
    )
}

/// The first plan: a focus above the array's centre, and planes below, at and above it. `None` if the travel has no room for it.
pub(super) fn plan(answers: &Answers, rig: &str) -> Option<String> {
    let [x0, x1, y0, y1, z0, z1] = answers.travel_mm;
    let [x, y, z] = answers.centre_mm;
    let reach = [x - x0, x1 - x, y - y0, y1 - y].into_iter().fold(f64::INFINITY, f64::min);
    let size_mm = (2.0 * (reach - MARGIN_MM)).min(60.0);
    let lowest_mm = (z0 - z + MARGIN_MM).max(ABOVE_MM + MARGIN_MM);
    let highest_mm = z1 - z - MARGIN_MM;
    let focus_mm = (0.5 * (lowest_mm + highest_mm)).min(100.0).max(lowest_mm);
    if size_mm < 10.0 || highest_mm < lowest_mm {
        return None;
    }
    let mut heights_mm =
        vec![(0.6 * focus_mm).max(lowest_mm), focus_mm, (1.5 * focus_mm).min(highest_mm)];
    heights_mm.dedup_by(|a, b| (*a - *b).abs() < 5.0);
    let step_mm = size_mm / 20.0;
    Some(format!(
        "# A first scan: the field at, below and above a focus over the array's centre.\n\
         # `--dry-run` says whether every path is inside the travel, and how long it takes.\n\
         name = \"first-scan\"\n\
         rig = {rig}\n\n\
         [simulator]\n\
         model = \"piston\"                    # or corrected, as-written\n\n\
         [[focus]]\n\
         x_mm = 0.0\n\
         y_mm = 0.0\n\
         z_mm = {focus}\n\n\
         [dark]                              # readings with the array silent: the noise\n\
         before = 16\n\n\
         [[plane]]\n\
         z_mm = [{heights}]\n\
         centre_mm = [0.0, 0.0]\n\
         size_mm = [{size}, {size}]\n\
         step_mm = {step}\n",
        rig = quoted(rig),
        focus = float(focus_mm),
        heights = heights_mm.into_iter().map(float).collect::<Vec<_>>().join(", "),
        size = float(size_mm),
        step = float(step_mm),
    ))
}
