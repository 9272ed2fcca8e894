//! The HTTP API around a real engine; only the network is a stand-in.
#![expect(clippy::unwrap_used, reason = "a test stops at the first surprise")]

mod access;
mod areas;
mod calibration_changes;
mod calibrations;
mod connections;
mod deepstack;
mod detect;
mod detector;
mod ending;
mod extremes;
mod kept_pictures;
mod load;
mod log;
mod logs;
mod metrics_table;
mod operation;
mod picture;
mod rate_limit;
mod refusals;
mod remote;
mod report;
mod repository;
mod results;
mod results_away;
mod results_events;
mod results_wait;
mod serve;
mod server;
mod service;
mod slow;
mod tls;
mod traces;
mod unread;
mod v2;
mod web_pages;
