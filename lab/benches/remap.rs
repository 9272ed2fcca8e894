//! Benchmarks of remap tables: building those of a plan, and rendering a view, with and without
//! vector instructions. `cargo bench --bench remap` prints milliseconds (median and minimum of many
//! rounds), also of rendering as in the server, where the network has evicted the frame from the
//! caches.
//!
//! `cargo bench --bench remap -- rounds FOLDER SIDE` is Lookdown's half of `against_opencv.py`. It
//! writes the input of both halves into the folder. Then it reads indices of views, a line each,
//! renders each view and prints the duration in nanoseconds.

#[path = "support/times.rs"]
mod times;

use std::{
    error::Error,
    f64::consts::FRAC_PI_2,
    fs,
    hint::black_box,
    io::{BufRead, stdin},
    path::Path,
    time::Instant,
};

use lookdown_imaging::{Frame, NetworkInput, RemapTable};
use lookdown_lens::geometry::{FieldOfViewReading, Lens, Mount, ViewPlan};

use self::times::{times, times_after};

const FRAME_SIDE: u32 = 1680;
const ROUNDS: usize = 240;
/// Words of memory that a network reads between views: more than the caches hold.
const NETWORK_WORDS: usize = 6 << 20;

type Outcome<T> = Result<T, Box<dyn Error>>;

fn main() -> Outcome<()> {
    let arguments: Vec<_> = std::env::args()
        .skip(1)
        .filter(|word| word != "--bench")
        .collect();
    match arguments.as_slice() {
        [] => print_times(),
        [word, folder, side] if word == "rounds" => answer_rounds(Path::new(folder), side.parse()?),
        _ => Err("usage: remap [rounds FOLDER SIDE]".into()),
    }
}

fn print_times() -> Outcome<()> {
    let plans = [
        ("fast", ViewPlan::fast()),
        ("balanced", ViewPlan::balanced()),
        ("paper", ViewPlan::paper(FieldOfViewReading::default())),
    ];
    for (name, plan) in &plans {
        for (how, mount) in [("straight down", Mount::default()), ("10° off", tilted())] {
            let views = plan.views(&mount, 416, 416);
            let lens = lens()?;
            let tables = RemapTable::for_views(&views, &lens, FRAME_SIDE, FRAME_SIDE);
            let time = times(ROUNDS, || {
                black_box(RemapTable::for_views(&views, &lens, FRAME_SIDE, FRAME_SIDE));
            });
            let bytes = RemapTable::bytes(&tables);
            println!("tables of {name}, {how}: {time}, {} KiB", bytes / 1024);
        }
    }
    let frame = frame()?;
    let mut network = vec![0_u64; NETWORK_WORDS];
    for side in [300, 416] {
        let (tables, input) = (tables(side)?, NetworkInput::plain(side, side));
        let mut slot = vec![0.0; input.view_len()];
        let mut view = 0;
        let mut next = || {
            view = (view + 1) % tables.len();
            &tables[view]
        };
        let vector = times(ROUNDS, || next().render(&frame, &input, &mut slot));
        println!("a view of {side}², vector: {vector}");
        let another = || {
            for word in &mut network {
                *word = black_box(*word + 1);
            }
        };
        let render = || next().render(&frame, &input, &mut slot);
        let after_network = times_after(ROUNDS, another, render);
        println!("a view of {side}², vector, with nothing in the caches: {after_network}");
        let portable = times(ROUNDS, || next().render_portably(&frame, &input, &mut slot));
        println!("a view of {side}², portable: {portable}");
    }
    Ok(())
}

/// Writes the frame (`frame.rgb`) and the positions of the views (`positions.f32`: x, y, pixel by
/// pixel and view by view; −1000 outside the lens image), then renders one view per line.
fn answer_rounds(folder: &Path, side: u32) -> Outcome<()> {
    let (frame, tables) = (frame()?, tables(side)?);
    let input = NetworkInput {
        scale: [1.0 / 57.0; 3],
        offset: [103.5, 116.3, 123.7].map(|mean: f32| -mean / 57.0),
        ..NetworkInput::plain(side, side)
    };
    fs::write(folder.join("frame.rgb"), frame.pixels())?;
    let mut positions = Vec::new();
    for table in &tables {
        for (y, x) in (0..side).flat_map(|y| (0..side).map(move |x| (y, x))) {
            let position = table.position(x, y);
            let position = position.map_or([-1000.0; 2], |at| [at.x, at.y]);
            #[expect(clippy::cast_possible_truncation, reason = "as tables keep them")]
            positions.extend(
                position
                    .into_iter()
                    .flat_map(|value| (value as f32).to_le_bytes()),
            );
        }
    }
    fs::write(folder.join("positions.f32"), positions)?;
    let mut batch = vec![0.0; tables.len() * input.view_len()];
    // The output buffer is reused for every view, as in the server and in OpenCV's half.
    let mut slot = vec![0.0; input.view_len()];
    println!("{} {}", tables.len(), FRAME_SIDE);
    for line in stdin().lock().lines() {
        let view: usize = line?.parse()?;
        let started = Instant::now();
        tables[view].render(&frame, &input, &mut slot);
        println!("{}", started.elapsed().as_nanos());
        batch[view * input.view_len()..][..input.view_len()].copy_from_slice(&slot);
    }
    let bytes: Vec<u8> = batch.iter().flat_map(|value| value.to_le_bytes()).collect();
    fs::write(folder.join("views.f32"), bytes)?;
    Ok(())
}

fn lens() -> Outcome<Lens> {
    let middle = f64::from(FRAME_SIDE - 1) / 2.0;
    Ok(Lens::equidistant_circle(
        middle,
        middle,
        middle + 0.5,
        FRAC_PI_2,
    )?)
}

fn tilted() -> Mount {
    let up = nalgebra::Unit::new_normalize(nalgebra::Vector3::new(0.176, 0.0, -1.0));
    Mount::new(up, None)
}

fn tables(side: u32) -> Outcome<Vec<RemapTable>> {
    let views = ViewPlan::balanced().views(&Mount::default(), side, side);
    Ok(RemapTable::for_views(
        &views,
        &lens()?,
        FRAME_SIDE,
        FRAME_SIDE,
    ))
}

/// Noise, which caches and branch predictors cannot exploit.
fn frame() -> Outcome<Frame> {
    let bytes = 0..FRAME_SIDE * FRAME_SIDE * 3;
    let pixels = bytes.map(|index| index.wrapping_mul(2_654_435_761).to_le_bytes()[3]);
    Ok(Frame::new(FRAME_SIDE, FRAME_SIDE, pixels.collect())?)
}
