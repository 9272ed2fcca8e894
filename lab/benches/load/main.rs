//! Loads an HTTP server with repetitions of one request, and prints statistics of the responses as
//! JSON on standard output.
//!
//! Closed loop: every client sends its next request as soon as it has the response. Open loop
//! (`--rate`): requests are due at times that do not depend on the responses. Latencies count from
//! the due time, so that a stalled server shows (no coordinated omission).
//!
//! Runs on one thread, to leave the CPU to a server on the same machine. Memory does not grow with
//! the number of requests.

mod client;
mod pace;
mod tally;

use std::{cell::RefCell, path::PathBuf, rc::Rc, time::Duration};

use anyhow::Context;
use bytes::Bytes;
use clap::Parser;
use tokio::{
    task::LocalSet,
    time::{Instant, timeout_at},
};

use self::{
    client::{Client, Target},
    pace::{Arrivals, Pace},
    tally::Tally,
};

/// Loads an HTTP server and prints statistics of the responses.
#[derive(Parser)]
struct Arguments {
    /// Address and port of the server.
    address: String,
    /// Path and query of the POST; several are used in turns.
    #[arg(long, required = true)]
    path: Vec<String>,
    /// The file to send as the body.
    #[arg(long)]
    body: PathBuf,
    /// The media type of the body.
    #[arg(long, default_value = "image/jpeg")]
    content_type: String,
    /// Clients with a connection each. Open loop: the maximum of simultaneous requests.
    #[arg(long, default_value_t = 1)]
    clients: usize,
    /// Open loop: requests per second.
    #[arg(long)]
    rate: Option<f64>,
    /// Open loop: the distribution of the requests.
    #[arg(long, value_enum, default_value_t = Arrivals::Poisson)]
    arrivals: Arrivals,
    /// Seconds of load before the measurement.
    #[arg(long, default_value_t = 1.0)]
    warm_up_seconds: f64,
    /// Seconds of the measurement.
    #[arg(long, default_value_t = 10.0)]
    seconds: f64,
    /// Timeout of a response in seconds.
    #[arg(long, default_value_t = 600.0)]
    timeout_seconds: f64,
}

#[tokio::main(flavor = "current_thread")]
async fn main() -> anyhow::Result<()> {
    let arguments = Arguments::parse();
    let body = std::fs::read(&arguments.body)
        .with_context(|| format!("--body: {} cannot be read", arguments.body.display()))?;
    let timeout = seconds("timeout-seconds", arguments.timeout_seconds)?;
    let begin = Instant::now() + seconds("warm-up-seconds", arguments.warm_up_seconds)?;
    let end = begin + seconds("seconds", arguments.seconds)?;
    let pace = match arguments.rate {
        Some(rate) if rate.is_finite() && rate > 0.0 => {
            Pace::open(rate, arguments.arrivals, Instant::now(), end)
        }
        Some(rate) => anyhow::bail!("--rate: {rate} requests per second; it must be above 0"),
        None => Pace::closed(end),
    };
    let target = Rc::new(Target {
        address: arguments.address,
        paths: arguments.path,
        content_type: arguments.content_type,
        body: Bytes::from(body),
        timeout,
    });
    let pace = Rc::new(RefCell::new(pace));
    let tally = Rc::new(RefCell::new(Tally::new(
        begin..end,
        arguments.rate.is_some(),
    )));

    let local = LocalSet::new();
    for index in 0..arguments.clients {
        let client = Client::new(Rc::clone(&target), index);
        local.spawn_local(client.run(Rc::clone(&pace), Rc::clone(&tally)));
    }
    // A closed loop counts the requests that end in time; an open loop waits for all of them.
    let last = arguments.rate.map_or(end, |_| end + timeout);
    let _ = timeout_at(last, local).await;
    println!("{}", tally.borrow().summary());
    Ok(())
}

fn seconds(name: &str, value: f64) -> anyhow::Result<Duration> {
    Duration::try_from_secs_f64(value).with_context(|| format!("--{name}: {value} seconds"))
}
