//! The tuning of a profile in a manifest.

use anyhow::Context;
use lookdown_detect::parameters::{Profile, Tuning};
use toml_edit::{DocumentMut, Item, Table, value};

/// Enters the tuning of a profile. The rest of the manifest stays as it is, with its comments.
pub(super) fn set(
    manifest: &mut DocumentMut,
    profile: Profile,
    tuning: &Tuning,
) -> anyhow::Result<()> {
    let Tuning {
        even_odds,
        odds_power,
        crop_fill,
        crop_vote,
    } = *tuning;
    let tunings = manifest.entry("tuning").or_insert_with(|| {
        let mut table = Table::new();
        table.set_implicit(true);
        Item::Table(table)
    });
    let tunings = tunings.as_table_mut().context("tuning is not a table")?;
    let mut table = Table::new();
    for (key, number) in [
        ("even_odds", even_odds),
        ("odds_power", odds_power),
        ("crop_fill", crop_fill),
        ("crop_vote", crop_vote),
    ] {
        table.insert(key, value(number));
    }
    tunings.insert(profile.name(), Item::Table(table));
    Ok(())
}
