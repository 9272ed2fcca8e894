//! Logs and traces. Metrics are in `metrics`.

mod collector;
mod incoming;
mod logs;
mod request_trace;
mod tracer;

pub use incoming::IncomingTrace;
pub use logs::{log_subscriber, start_logs};
pub use request_trace::RequestTrace;
pub use tracer::Tracer;
