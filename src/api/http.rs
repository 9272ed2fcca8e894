//! HTTP infrastructure: problem documents, deadlines, request bodies, conditional requests and the
//! layers around every route. No file here depends on a route or a protocol.

pub(super) mod accept;
pub(super) mod access;
pub(super) mod context;
pub(super) mod cors;
pub(super) mod deadline;
pub(super) mod drain_body;
pub(super) mod envelope;
pub(super) mod problem;
pub(super) mod query;
pub(super) mod rate_limit;
pub(super) mod request_body;
