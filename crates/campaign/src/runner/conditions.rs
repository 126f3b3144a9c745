//! Setting the conditions of a block of cells, and confirming them.

use jiff::SignedDuration;

use super::Runner;
use crate::condition::{Condition, ConditionValue, Confirmation, ConfirmedBy, SetBy};
use crate::design::Block;
use crate::error::CampaignError;
use crate::folder::What;
use crate::laboratory::News;

impl Runner<'_> {
    /// Sets and confirms every condition of a block; false where one does not hold, which is logged and told. Its cells stay open.
    pub(super) async fn set_conditions(&self, block: &Block) -> Result<bool, CampaignError> {
        for (condition, &value) in self.campaign.conditions.iter().zip(&block.conditions) {
            let value = &condition.values[value];
            match self.set_and_confirm(condition, value).await {
                Ok(reading) => {
                    let (name, label) = (condition.name.clone(), value.label.clone());
                    self.log(What::Set { condition: name, value: label, reading })?;
                    self.laboratory.tell(News::Set(condition, value, reading)).await;
                }
                Err(reason) => {
                    let (condition_name, label) = (condition.name.clone(), value.label.clone());
                    self.log(What::NotSet {
                        condition: condition_name,
                        value: label,
                        reason: reason.clone(),
                    })?;
                    self.laboratory.tell(News::NotSet(condition, value, &reason)).await;
                    return Ok(false);
                }
            }
        }
        Ok(true)
    }

    async fn set_and_confirm(
        &self,
        condition: &Condition,
        value: &ConditionValue,
    ) -> Result<Option<f64>, String> {
        let question = match &condition.setting {
            SetBy::Person(question) => Some(value.within(question)),
            SetBy::Program(_) => None,
        };
        if question.is_some() {
            self.draw(question.clone()).await;
        }
        let set = self.laboratory.set(condition, value).await;
        // Whatever the answer was, nobody is asked any more.
        if question.is_some() {
            self.draw(None).await;
        }
        set?;
        let Some(Confirmation { by, within_s, every_s }) = &condition.confirm else {
            return Ok(None);
        };
        let after = |seconds: f64| {
            let wait = SignedDuration::try_from_secs_f64(seconds).unwrap_or(SignedDuration::MAX);
            self.laboratory.now().checked_add(wait).unwrap_or(jiff::Timestamp::MAX)
        };
        let deadline = after(*within_s);
        loop {
            let read = self.laboratory.read(by, value, &self.campaign.benches).await;
            let refused = match (read, by) {
                (
                    Ok(Some(reading)),
                    ConfirmedBy::Sensor(_, tolerance) | ConfirmedBy::Number(_, tolerance),
                ) => {
                    let wanted = value.number.unwrap_or(f64::NAN);
                    if (reading - wanted).abs() <= *tolerance {
                        return Ok(Some(reading));
                    }
                    format!("{reading} was read, and {wanted} ± {tolerance} is wanted")
                }
                (Ok(reading), _) => return Ok(reading),
                (Err(reason), _) => reason,
            };
            if self.laboratory.now() >= deadline {
                return Err(format!("not confirmed within {:.1} min: {refused}", within_s / 60.0));
            }
            self.wait(after(*every_s).min(deadline), "for a condition").await?;
        }
    }
}
