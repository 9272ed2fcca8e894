//! The memory budget of requests: their bodies, and the tensors unpacked from them.

use std::sync::Arc;

use bytes::Bytes;
use lookdown_detect::fairness::{BudgetError, BudgetShare, Client, SharedBudget};

use crate::api::http::problem::{Problem, ProblemKind};

/// The memory of all bodies and of the tensors unpacked from them, in bytes. Clones share it.
#[derive(Clone)]
pub(in crate::api) struct UploadBudget {
    bytes: SharedBudget,
    /// The client that uses it.
    client: Client,
    /// The advice for a client whose body finds no free memory.
    remedy: &'static str,
}

impl UploadBudget {
    /// Creates a budget. One client may use at most half of it, but at least `least_share`.
    pub(in crate::api) fn new(bytes: usize, least_share: usize, remedy: &'static str) -> Self {
        Self {
            bytes: SharedBudget::with_least_share(bytes, least_share),
            client: Client::Others,
            remedy,
        }
    }

    /// Returns the same budget as a client may use it.
    pub(in crate::api) fn for_client(&self, client: &Client) -> Self {
        Self {
            client: client.clone(),
            ..self.clone()
        }
    }

    /// Reserves a number of bytes until the permit is dropped. Fails when fewer are free.
    pub(in crate::api) fn take(&self, bytes: usize) -> Result<BudgetShare, Problem> {
        let share = self.bytes.take(&self.client, bytes);
        share.map_err(|error| self.exhausted(error))
    }

    fn exhausted(&self, error: BudgetError) -> Problem {
        let (client, remedy) = (&self.client, self.remedy);
        let detail = match error {
            BudgetError::Full => {
                format!("too many request bodies are in memory already: {remedy}")
            }
            BudgetError::ShareUsed { share } => format!(
                "{client} uses its share of the memory for request bodies already ({share} \
                 bytes): {remedy}"
            ),
        };
        Problem::new(ProblemKind::Overloaded, detail)
    }
}

/// A value in memory together with its permit.
pub(in crate::api) struct Held<T> {
    content: T,
    _share: BudgetShare,
}

impl<T> Held<T> {
    pub(in crate::api) fn new(content: T, share: BudgetShare) -> Self {
        Self {
            content,
            _share: share,
        }
    }
}

impl Held<Bytes> {
    pub(in crate::api) fn bytes(&self) -> Bytes {
        self.content.clone()
    }

    /// Replaces the bytes by a copied part of them.
    pub(in crate::api) fn with_bytes(self, content: Bytes) -> Self {
        Self { content, ..self }
    }

    /// Returns plain bytes that release the permit when their last clone is dropped.
    pub(in crate::api) fn into_bytes(self) -> Bytes {
        Bytes::from_owner(self)
    }
}

impl Held<Vec<Bytes>> {
    /// Returns plain bytes that release the permit when the last clone of the last element is
    /// dropped.
    pub(in crate::api) fn into_elements(self) -> Vec<Bytes> {
        let all = Arc::new(self);
        let elements = (0..all.content.len()).map(|index| {
            Bytes::from_owner(HeldElement {
                all: Arc::clone(&all),
                index,
            })
        });
        elements.collect()
    }
}

/// An element in memory together with the permit of all elements.
struct HeldElement {
    all: Arc<Held<Vec<Bytes>>>,
    index: usize,
}

impl AsRef<[u8]> for HeldElement {
    fn as_ref(&self) -> &[u8] {
        &self.all.content[self.index]
    }
}

impl<T: AsRef<U>, U: ?Sized> AsRef<U> for Held<T> {
    fn as_ref(&self) -> &U {
        self.content.as_ref()
    }
}
