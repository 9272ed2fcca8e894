//! A budget of permits for all clients together. One client may use at most half of it, so one
//! client cannot take everything.

use std::{collections::HashMap, sync::Arc};

use parking_lot::Mutex;

use super::Client;

/// A budget, such as the frames in flight or the bytes of request bodies. Clones share it.
///
/// A client may use at most half of the budget, but at least `least_share`. [`Client::Only`] may
/// use all of it.
#[derive(Debug, Clone)]
pub struct SharedBudget(Arc<Shared>);

#[derive(Debug)]
struct Shared {
    total: usize,
    share: usize,
    // No change can panic half-way.
    usage: Mutex<Usage>,
}

/// The permits in use. Only clients that hold permits have an entry.
#[derive(Debug, Default)]
struct Usage {
    used: usize,
    by_client: HashMap<Client, usize>,
}

/// The reason why a client gets no more permits now.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BudgetError {
    /// All clients together use too much of the budget.
    Full,
    /// The client would use more than its share.
    ShareUsed {
        /// The largest use of one client.
        share: usize,
    },
}

impl SharedBudget {
    /// Creates a budget of `total` permits.
    pub fn new(total: usize) -> Self {
        Self::with_least_share(total, 1)
    }

    /// Creates a budget of `total` permits, of which each client may use at least `least_share`.
    pub fn with_least_share(total: usize, least_share: usize) -> Self {
        Self(Arc::new(Shared {
            total,
            share: (total / 2).max(least_share).min(total),
            usage: Mutex::default(),
        }))
    }

    /// Takes permits for a client until the returned share is dropped.
    ///
    /// # Errors
    /// [`BudgetError`] when the budget, or the share of the client, is too small now.
    pub fn take(&self, client: &Client, amount: usize) -> Result<BudgetShare, BudgetError> {
        let mut usage = self.0.usage.lock();
        self.0.check(&usage, client, amount)?;
        if amount > 0 {
            usage.used += amount;
            *usage.by_client.entry(client.clone()).or_default() += amount;
        }
        Ok(BudgetShare {
            budget: self.clone(),
            client: client.clone(),
            amount,
        })
    }

    /// Checks that a client could take this many permits now.
    ///
    /// # Errors
    /// The same as [`SharedBudget::take`].
    pub fn check(&self, client: &Client, amount: usize) -> Result<(), BudgetError> {
        self.0.check(&self.0.usage.lock(), client, amount)
    }

    /// The number of permits.
    pub fn total(&self) -> usize {
        self.0.total
    }

    /// The largest number of permits that one of several clients may use.
    pub fn share(&self) -> usize {
        self.0.share
    }

    /// The number of permits in use.
    #[cfg(test)]
    fn used(&self) -> usize {
        self.0.usage.lock().used
    }
}

impl Shared {
    fn check(&self, usage: &Usage, client: &Client, amount: usize) -> Result<(), BudgetError> {
        let own = usage.by_client.get(client).copied().unwrap_or(0);
        if *client != Client::Only && amount > self.share.saturating_sub(own) {
            return Err(BudgetError::ShareUsed { share: self.share });
        }
        if amount > self.total - usage.used {
            return Err(BudgetError::Full);
        }
        Ok(())
    }
}

/// Permits of a client. Dropping them returns them to the budget.
#[derive(Debug)]
pub struct BudgetShare {
    budget: SharedBudget,
    client: Client,
    amount: usize,
}

impl BudgetShare {
    /// Adds more permits of the same client and budget.
    pub fn merge(&mut self, mut more: Self) {
        debug_assert_eq!(self.client, more.client, "the permits have one holder");
        self.amount += std::mem::take(&mut more.amount);
    }
}

impl Drop for BudgetShare {
    fn drop(&mut self) {
        if self.amount == 0 {
            return;
        }
        let mut usage = self.budget.0.usage.lock();
        usage.used -= self.amount;
        if let Some(own) = usage.by_client.get_mut(&self.client) {
            *own -= self.amount;
            if *own == 0 {
                usage.by_client.remove(&self.client);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(name: &str) -> Client {
        Client::with_key(name)
    }

    #[test]
    fn one_client_gets_half_and_the_rest_stays_for_others() {
        let budget = SharedBudget::new(8);
        let greedy: Vec<_> = (0..20).map(|_| budget.take(&key("greedy"), 1)).collect();
        assert_eq!(greedy.iter().filter(|taken| taken.is_ok()).count(), 4);
        let refused = greedy.last().unwrap().as_ref().unwrap_err();
        assert_eq!(*refused, BudgetError::ShareUsed { share: 4 });
        let others: Vec<_> = (0..4)
            .map(|n| budget.take(&key(&format!("{n}")), 1))
            .collect();
        assert!(others.iter().all(Result::is_ok));
        let full = budget.take(&key("late"), 1).unwrap_err();
        assert_eq!(full, BudgetError::Full);
        drop((greedy, others));
        assert_eq!(budget.used(), 0);
        assert!(budget.0.usage.lock().by_client.is_empty());
    }

    #[test]
    fn the_only_client_may_use_the_whole_budget() {
        let budget = SharedBudget::new(8);
        let all = budget.take(&Client::Only, 8).unwrap();
        assert_eq!(
            budget.take(&Client::Only, 1).unwrap_err(),
            BudgetError::Full
        );
        drop(all);
        assert_eq!(budget.used(), 0);
    }

    #[test]
    fn the_smallest_budget_still_serves_each_client() {
        let budget = SharedBudget::new(1);
        let one = budget.take(&key("one"), 1).unwrap();
        assert_eq!(budget.take(&key("two"), 1).unwrap_err(), BudgetError::Full);
        drop(one);
        assert!(budget.take(&key("two"), 1).is_ok());
    }

    #[test]
    fn the_largest_permitted_body_fits_into_a_share() {
        let budget = SharedBudget::with_least_share(100, 80);
        let mut body = budget.take(&key("gate"), 50).unwrap();
        body.merge(budget.take(&key("gate"), 30).unwrap());
        let refused = budget.take(&key("gate"), 1).unwrap_err();
        assert_eq!(refused, BudgetError::ShareUsed { share: 80 });
        assert!(budget.take(&key("other"), 20).is_ok());
        drop(body);
        assert_eq!(budget.used(), 0);
    }
}
