//! Logs and traces. Metrics are in `metrics`.

mod logs;
mod request_trace;
mod tracer;

pub use logs::{log_subscriber, start_logs};
pub use request_trace::RequestTrace;
pub use tracer::{IncomingTrace, Tracer};
