//! The caller of a request: the client whose share of the budgets it uses, and its highest permitted
//! priority.

use std::{
    convert::Infallible,
    net::{IpAddr, SocketAddr},
};

use axum::{extract::FromRequestParts, http::request::Parts};
use lookdown_detect::{
    fairness::{Client, PriorityLevel},
    parameters::Priority,
    pipeline::Ticket,
};

use lookdown_http::request_id::RequestId;

use super::{
    ApiState,
    http::{
        access::Access,
        problem::{Problem, ProblemKind},
    },
};
use crate::access::Holder;

/// The caller of a request.
#[derive(Debug, Clone)]
pub(super) struct Caller {
    /// The client for budgets and turns.
    pub(super) client: Client,
    /// The highest priority that the client may use.
    highest_priority: Priority,
    /// The ID of the request.
    request_id: String,
}

impl Caller {
    /// Returns the caller with the key in this head. The routes check the key itself.
    pub(super) fn of(parts: &Parts, state: &ApiState) -> Self {
        let access = &state.options.access;
        let holder = access.holder(&parts.headers);
        let address = parts.extensions.get::<SocketAddr>().map(SocketAddr::ip);
        let request_id = parts.extensions.get::<RequestId>();
        Self {
            client: client(access, holder.as_ref(), address),
            highest_priority: highest_priority(access, holder.as_ref()),
            request_id: request_id.map_or_else(String::new, |id| id.as_str().to_owned()),
        }
    }

    /// Returns this caller with the key that its form holds, if it has one.
    pub(super) fn with_holder(self, access: &Access, holder: Option<&Holder>) -> Self {
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
    pub(super) fn ticket(&self) -> Ticket {
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
    pub(super) fn ticket_at(&self, priority: Priority) -> Result<Ticket, Problem> {
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

impl FromRequestParts<ApiState> for Caller {
    type Rejection = Infallible;

    async fn from_request_parts(parts: &mut Parts, state: &ApiState) -> Result<Self, Infallible> {
        Ok(Self::of(parts, state))
    }
}

fn client(access: &Access, holder: Option<&Holder>, address: Option<IpAddr>) -> Client {
    match (access, holder) {
        (Access::Keys(keys), Some(_)) if keys.known().len() == 1 => Client::Only,
        (_, Some(holder)) => Client::with_key(holder.name.as_str()),
        (
            Access::Open {
                own_machine_only: true,
            },
            None,
        ) => Client::Only,
        (_, None) => address.map_or(Client::Others, Client::at),
    }
}

/// On a server without keys that other machines reach, no client is preferred to another.
fn highest_priority(access: &Access, holder: Option<&Holder>) -> Priority {
    match (access, holder) {
        (_, Some(holder)) => Priority::of_level(holder.highest_priority.get()),
        (
            Access::Open {
                own_machine_only: true,
            },
            None,
        ) => Priority::High,
        (_, None) => Priority::Normal,
    }
}
