//! Random ways in random rooms: none that is sent touches a keep-out box or leaves the travel. The check is another than the
//! guard's: each way that was sent is sampled densely.

use std::sync::{Arc, Mutex};

use async_trait::async_trait;
use fieldgap::input::Positive;
use fieldgap::rig::motion::guarded::Guarded;
use fieldgap::rig::motion::travel::{AxisBox, KeepOut};
use fieldgap::rig::{
    Cause, Device, Emergency, Envelope, Feed, Motion, RigError, RobotPosition, Role,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Samples of each way that was sent; the thinnest boxes are drawn thicker than the longest way over this.
const SAMPLES: u32 = 400;

/// A robot that goes where it is told, and notes each way.
struct Notebook {
    device: Device,
    at: [f64; 3],
    ways: Arc<Mutex<Vec<[[f64; 3]; 2]>>>,
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
        self.ways.lock().expect("not poisoned").push([self.at, to]);
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

    /// Where a sampled way is where it must not be; a nanometre on the edge of travel is rounding.
    fn trespass(&self, [from, to]: [[f64; 3]; 2]) -> Option<[f64; 3]> {
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

/// Sends so many random ways, and gives how many were sent and how many refused.
async fn sent_and_refused(ways: usize, seed: u64) -> (usize, usize) {
    const WAYS_A_ROOM: usize = 100;
    let mut draws = ChaCha8Rng::seed_from_u64(seed);
    let feed = Feed::from_mm_s(Positive::new(80.0).expect("above zero"));
    let (mut sent, mut refused) = (0, 0);
    while sent + refused < ways {
        let room = Room::draw(&mut draws);
        let home = inside(&room.travel, 0.0, &mut draws);
        if room.trespass([home, home]).is_some() {
            continue;
        }
        let keep_out = |space: &AxisBox| KeepOut { name: "a box".into(), space: *space };
        let envelope =
            Envelope { travel: room.travel, keep_out: room.boxes.iter().map(keep_out).collect() };
        let noted = Arc::default();
        let robot = Notebook {
            device: Device::new(Role::Robot, "memory"),
            at: home,
            ways: Arc::clone(&noted),
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
        for &way in &*noted.lock().expect("not poisoned") {
            assert_eq!(room.trespass(way), None, "on the way {way:?}");
        }
    }
    (sent, refused)
}

#[tokio::test]
async fn of_a_million_ways_none_that_is_sent_leaves_the_travel_or_enters_a_box() {
    let (sent, refused) = sent_and_refused(1_000_000, 2).await;
    println!("{sent} sent, {refused} refused");
    assert!(sent > 100_000 && refused > 100_000, "{sent} sent, {refused} refused");
}
