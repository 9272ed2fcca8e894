//! Prints the persons of a frame: `cargo run --example detect -- FRAME [SERVER]`.

use std::{env, error::Error, fs};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = env::args().skip(1);
    let frame = arguments.next().ok_or("give the file of a frame")?;
    let server = arguments.next();
    let server = server.as_deref().unwrap_or("http://localhost:8080");
    for person in persons(&fs::read(frame)?, server)? {
        println!(
            "{:.2} {}",
            person["score"].as_f64().unwrap_or(0.0),
            person["box"]
        );
    }
    Ok(())
}

/// Sends a frame to a server, and returns the persons of its report.
pub(crate) fn persons(
    frame: &[u8],
    server: &str,
) -> Result<Vec<serde_json::Value>, Box<dyn Error>> {
    let request = ureq::post(format!("{server}/detect?score_threshold=0.3"));
    let answer = request.content_type("image/jpeg").send(frame)?;
    let report: serde_json::Value = serde_json::from_reader(answer.into_body().into_reader())?;
    Ok(report["persons"].as_array().cloned().unwrap_or_default())
}
