//! Publishes counts and reports to an MQTT broker, with the discovery messages of Home Assistant.
//!
//! The protocol is MQTT 3.1.1. Everything is published with `QoS` 0, as only the current state
//! matters: each connection begins with all retained messages, so messages lost with the last
//! connection do not matter.

mod broker;
mod camera;
mod cameras;
mod counts;
mod discovery;
mod images;
mod occupancy;
mod publisher;
mod session;
mod switches;
mod topics;

pub use broker::{Broker, BrokerError};
pub use counts::{CountsOptions, CountsPublisher};
pub use discovery::Discovery;
pub use publisher::{MqttOptions, Publisher};
