//! Random paths in random workspaces: no sent path enters a keep-out box or leaves the travel. The check is independent of the
//! guard: each sent path is sampled densely.

use std::sync::{Arc, Mutex};

use async_trait::async_trait;
use fieldgap_input::Positive;
use fieldgap_rig::motion::guarded::Guarded;
use fieldgap_rig::travel::{AxisBox, KeepOut};
use fieldgap_rig::{
    Cause, Device, Emergency, Envelope, Feed, Motion, RigError, RobotPosition, Role,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Samples per sent path; boxes are thicker than the longest path over this number.
const SAMPLES: u32 = 400;

/// A robot that follows commands and records each path.
struct Notebook {
    device: Device,
    at: [f64; 3],
    paths: Arc<Mutex<Vec<[[f64; 3]; 2]>>>,
}

#[async_trait]
impl Motion for Notebook {
    fn device(&self) -> &Device {
        &self.device
    }
    fn firmware(&self) -> &str {
        "notebook"
    }
    async fn home(&mut self) -> Result<RobotPosition, RigError> {
        Ok(RobotPosition::from_axes_m(self.at))
    }
    async fn move_to(&mut self, target: RobotPosition, _: Feed) -> Result<RobotPosition, RigError> {
        let to = target.axes_m();
        self.paths.lock().expect("not poisoned").push([self.at, to]);
        self.at = to;
        Ok(target)
    }
    async fn position(&mut self) -> Result<RobotPosition, RigError> {
        Ok(RobotPosition::from_axes_m(self.at))
    }
    async fn stop(&mut self) -> Result<(), RigError> {
        Ok(())
    }
    fn emergency(&self) -> Option<Emergency> {
        None
    }
}

struct Room {
    travel: AxisBox,
    boxes: Vec<AxisBox>,
}

impl Room {
    fn draw(draws: &mut ChaCha8Rng) -> Self {
        let least_m = [(); 3].map(|()| draws.random_range(-0.1..0.1));
        let largest_m = least_m.map(|least| least + draws.random_range(0.05..0.5));
        let travel = AxisBox { least_m, largest_m };
        let boxes = (0..draws.random_range(1..5))
            .map(|_| {
                let corner = inside(&travel, 0.02, draws);
                let size = [(); 3].map(|()| draws.random_range(0.005..0.15));
                AxisBox { least_m: corner, largest_m: [0, 1, 2].map(|k| corner[k] + size[k]) }
            })
            .collect();
        Self { travel, boxes }
    }

    /// A sample of a path that is not allowed, if any; a nanometre beyond the travel is rounding.
    fn violation(&self, [from, to]: [[f64; 3]; 2]) -> Option<[f64; 3]> {
        let within = |space: &AxisBox, at: [f64; 3], slack: f64| {
            (0..3).all(|k| at[k] >= space.least_m[k] - slack && at[k] <= space.largest_m[k] + slack)
        };
        (0..=SAMPLES)
            .map(|step| {
                let share = f64::from(step) / f64::from(SAMPLES);
                [0, 1, 2].map(|k| from[k] + (to[k] - from[k]) * share)
            })
            .find(|&at| {
                !within(&self.travel, at, 2e-9)
                    || self.boxes.iter().any(|space| within(space, at, 0.0))
            })
    }
}

/// A point of a box, or up to `beyond` outside it.
fn inside(space: &AxisBox, beyond: f64, draws: &mut ChaCha8Rng) -> [f64; 3] {
    [0, 1, 2].map(|k| draws.random_range(space.least_m[k] - beyond..space.largest_m[k] + beyond))
}

/// Commands random paths; returns the numbers of sent and of refused ones.
async fn sent_and_refused(paths: usize, seed: u64) -> (usize, usize) {
    const WAYS_A_ROOM: usize = 100;
    let mut draws = ChaCha8Rng::seed_from_u64(seed);
    let feed = Feed::from_mm_s(Positive::new(80.0).expect("above zero"));
    let (mut sent, mut refused) = (0, 0);
    while sent + refused < paths {
        let room = Room::draw(&mut draws);
        let home = inside(&room.travel, 0.0, &mut draws);
        if room.violation([home, home]).is_some() {
            continue;
        }
        let keep_out = |space: &AxisBox| KeepOut { name: "a box".into(), space: *space };
        let envelope =
            Envelope { travel: room.travel, keep_out: room.boxes.iter().map(keep_out).collect() };
        let noted = Arc::default();
        let robot = Notebook {
            device: Device::new(Role::Robot, "memory"),
            at: home,
            paths: Arc::clone(&noted),
        };
        let mut robot = Guarded::new(Box::new(robot), envelope, 0.05e-3);
        robot.home().await.expect("it homes");
        for _ in 0..WAYS_A_ROOM {
            let target = RobotPosition::from_axes_m(inside(&room.travel, 0.02, &mut draws));
            match robot.move_to(target, feed).await {
                Ok(_) => sent += 1,
                Err(error) => {
                    assert!(matches!(error.cause(), Cause::Forbidden(_)), "{error}");
                    refused += 1;
                }
            }
        }
        for &path in &*noted.lock().expect("not poisoned") {
            assert_eq!(room.violation(path), None, "on the path {path:?}");
        }
    }
    (sent, refused)
}

async fn no_sent_path_leaves_the_travel_or_enters_a_box(paths: usize) {
    let (sent, refused) = sent_and_refused(paths, 2).await;
    println!("{sent} sent, {refused} refused");
    assert!(sent > paths / 10 && refused > paths / 10, "{sent} sent, {refused} refused");
}

#[tokio::test]
async fn no_path_of_a_hundred_thousand_leaves_the_travel_or_enters_a_box() {
    no_sent_path_leaves_the_travel_or_enters_a_box(100_000).await;
}

#[tokio::test]
#[ignore = "takes a minute"]
async fn no_path_of_a_million_leaves_the_travel_or_enters_a_box() {
    no_sent_path_leaves_the_travel_or_enters_a_box(1_000_000).await;
}
