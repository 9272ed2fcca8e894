//! Counts and reports for an MQTT broker, and what Home Assistant needs to find them there by itself.
//!
//! MQTT 3.1.1. Everything is published with `QoS` 0, as what counts is how things are now: a connection
//! begins with all that is to be retained, so that whatever was lost with the last one does not matter.

mod broker;
mod cameras;
mod connection;
mod discovery;
mod message;
mod publisher;
mod session;
mod topics;

pub use broker::{Broker, BrokerError};
pub use publisher::{MqttOptions, Publisher};
