//! The caller of a request: the client whose share of the budgets it uses, and its highest
//! permitted priority.

use std::net::{IpAddr, SocketAddr};

use axum::http::request::Parts;
use lookdown_detect::{
    fairness::{Client, PriorityLevel},
    parameters::Priority,
    pipeline::Ticket,
};

use lookdown_http::request_id::RequestId;

use super::{
    access::Access,
    problem::{Problem, ProblemKind},
};
use crate::access::Holder;

/// The caller of a request.
#[derive(Debug, Clone)]
pub(in crate::api) struct Caller {
    /// The client for budgets and turns.
    pub(in crate::api) client: Client,
    /// The client for the rate limit: a key or an address, even if no other client exists.
    pub(super) rate_limited: Client,
    /// The highest priority that the client may use.
    highest_priority: Priority,
    /// The ID of the request.
    request_id: String,
}

impl Caller {
    /// Returns the caller with the key of this holder. The routes check the key itself.
    pub(super) fn new(
        access: &Access,
        holder: Option<&Holder>,
        request_id: &RequestId,
        parts: &Parts,
    ) -> Self {
        let address = parts.extensions.get::<SocketAddr>().map(SocketAddr::ip);
        Self {
            client: client(access, holder, address),
            rate_limited: key_or_address(holder, address),
            highest_priority: highest_priority(access, holder),
            request_id: request_id.as_str().to_owned(),
        }
    }

    /// Returns this caller with the key that its form holds, if it has one.
    pub(in crate::api) fn with_holder(self, access: &Access, holder: Option<&Holder>) -> Self {
        if holder.is_none() {
            return self;
        }
        Self {
            client: client(access, holder, None),
            highest_priority: highest_priority(access, holder),
            ..self
        }
    }

    /// Returns the ticket of work at normal priority.
    pub(in crate::api) fn ticket(&self) -> Ticket {
        Ticket {
            client: self.client.clone(),
            request_id: self.request_id.clone(),
            ..Ticket::default()
        }
    }

    /// Returns the ticket of work at this priority.
    ///
    /// # Errors
    /// [`Problem`] if the caller may not use the priority.
    pub(in crate::api) fn ticket_at(&self, priority: Priority) -> Result<Ticket, Problem> {
        if priority < self.highest_priority {
            let (client, highest) = (&self.client, self.highest_priority.highest_level());
            let lowest = PriorityLevel::LOWEST;
            let detail = format!(
                "priority: {client} may use {highest} to {lowest}: send a larger number, or give the key a \
                 smaller one in access.keys_file, as highest_priority"
            );
            let problem = Problem::new(ProblemKind::Forbidden, detail);
            return Err(problem.with_parameter("priority"));
        }
        Ok(Ticket {
            priority,
            ..self.ticket()
        })
    }
}

fn client(access: &Access, holder: Option<&Holder>, address: Option<IpAddr>) -> Client {
    match (access, holder) {
        (Access::Keys(keys), Some(_)) if keys.known().len() == 1 => Client::Only,
        (
            Access::Open {
                own_machine_only: true,
            },
            None,
        ) => Client::Only,
        _ => key_or_address(holder, address),
    }
}

fn key_or_address(holder: Option<&Holder>, address: Option<IpAddr>) -> Client {
    match holder {
        Some(holder) => Client::with_key(holder.name.as_str()),
        None => address.map_or(Client::Others, Client::at),
    }
}

/// On a server without keys that other machines reach, no client is preferred to another.
fn highest_priority(access: &Access, holder: Option<&Holder>) -> Priority {
    match (access, holder) {
        (_, Some(holder)) => Priority::from_level(holder.highest_priority.get()),
        (
            Access::Open {
                own_machine_only: true,
            },
            None,
        ) => Priority::High,
        (_, None) => Priority::Normal,
    }
}
