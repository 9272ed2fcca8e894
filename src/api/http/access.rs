//! Authorization. With API keys, a request needs a key with the required scope. Without keys, a
//! loopback server permits everything to clients on the same machine, and an open server
//! (`access.open`) permits every client to detect and read.

use std::{
    net::{IpAddr, SocketAddr},
    sync::Arc,
};

use axum::http::{HeaderMap, request::Parts};
use lookdown_detect::{
    fairness::{Client, PriorityLevel},
    parameters::Priority,
    pipeline::Ticket,
};
use lookdown_http::{
    csrf::{AllowedOrigins, Remedies},
    keys::{only_key, presented},
    request_id::RequestId,
};

use super::problem::{Problem, ProblemKind};
use crate::{
    access::{AccessKeys, Holder, Scope},
    settings::AccessSettings,
};

/// The access rules of the server.
#[derive(Debug, Clone)]
pub enum Access {
    /// The server has no keys.
    Open {
        /// `true` if only clients on the same machine reach the server. They may then make changes.
        /// `false` with `access.open`.
        own_machine_only: bool,
    },
    /// Every request needs a key.
    Keys(Arc<AccessKeys>),
}

impl Access {
    /// Compares the key in the headers with all known keys, if there is exactly one.
    pub(in crate::api) fn identify(&self, headers: &HeaderMap) -> Option<Holder> {
        self.holder_of(only_key(presented(headers)).ok()?)
    }

    /// Checks that the keys allow `wanted` to the request with these headers, whose only key is
    /// that of `holder`. Its key may also be `elsewhere`, as in a form. Returns the holder of its
    /// key, if there are keys. Without keys, only a server that no other machine can reach allows
    /// changes.
    pub(in crate::api) fn check(
        &self,
        headers: &HeaderMap,
        holder: Option<&Holder>,
        elsewhere: Option<&str>,
        wanted: Scope,
    ) -> Result<Option<Holder>, Problem> {
        match self {
            Self::Open {
                own_machine_only: false,
            } if wanted == Scope::Admin => {
                let detail = "without keys, clients of an open server (access.open) may only detect \
                              and read: set access.keys_file and send a key with the scope admin";
                return Err(Problem::new(ProblemKind::Forbidden, detail));
            }
            Self::Open { .. } => return Ok(None),
            Self::Keys(_) => {}
        }
        let key = only_key(presented(headers).chain(elsewhere.map(str::as_bytes)))?;
        let holder = match elsewhere {
            Some(_) => self.holder_of(key),
            None => holder.cloned(),
        };
        let holder = holder.ok_or_else(|| {
            let detail = "the key is not valid: it was mistyped, or the server's operator \
                          has removed it";
            Problem::new(ProblemKind::KeyRequired, detail)
        })?;
        if holder.scopes.allow(wanted) {
            return Ok(Some(holder));
        }
        let detail = format!(
            "the key {} has the scope {}: this needs a key with the scope {wanted}",
            holder.name,
            holder.scopes.joined(" and "),
        );
        Err(Problem::new(ProblemKind::Forbidden, detail))
    }

    /// Returns the origins that may make changes; `None` if there are keys.
    pub(in crate::api) fn allowed_origins(
        &self,
        settings: &AccessSettings,
    ) -> Option<AllowedOrigins> {
        match self {
            Self::Open { own_machine_only } => Some(AllowedOrigins {
                own_machine_only: *own_machine_only,
                allowed: settings.cors_origins.as_slice().into(),
                hosts: settings.hosts.as_slice().into(),
                remedies: Remedies {
                    keys: "access.keys_file",
                    hosts: "add the name to access.hosts",
                    origins: "add a trusted origin to access.cors_origins",
                },
            }),
            Self::Keys(_) => None,
        }
    }

    /// Returns `true` if every request needs a key.
    pub(in crate::api) fn needs_keys(&self) -> bool {
        matches!(self, Self::Keys(_))
    }

    fn holder_of(&self, key: &[u8]) -> Option<Holder> {
        match self {
            Self::Open { .. } => None,
            Self::Keys(keys) => keys.holder_of(key),
        }
    }
}

/// Returns `true` if these headers hold any key, valid or not.
pub(in crate::api) fn shows_key(headers: &HeaderMap) -> bool {
    presented(headers).next().is_some()
}

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
