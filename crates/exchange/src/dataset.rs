//! Named arrays with dimensions, units and attributes: what a record becomes in every format of export.

/// Named arrays and what is known of them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Dataset {
    /// What holds for the whole file, by name.
    pub attributes: Vec<(String, Attribute)>,
    /// Names and lengths of the dimensions.
    pub dimensions: Vec<(String, usize)>,
    /// The arrays.
    pub variables: Vec<Variable>,
}

/// A text or numbers.
#[derive(Debug, Clone, PartialEq)]
pub enum Attribute {
    /// A text.
    Text(String),
    /// A number.
    Number(f64),
    /// Several numbers; at least one.
    Numbers(Vec<f64>),
}

/// An array.
#[derive(Debug, Clone, PartialEq)]
pub struct Variable {
    /// Its name: letters, digits and underscores.
    pub name: String,
    /// The dimensions, by their index in [`Dataset::dimensions`]; the last varies fastest.
    pub dimensions: Vec<usize>,
    /// The values, as many as the product of the dimensions.
    pub values: Values,
    /// The unit; `None` for numbers without one.
    pub unit: Option<String>,
    /// What the values are, in words.
    pub long_name: String,
    /// Names of the variables that state where and when, separated by blanks.
    pub coordinates: Option<String>,
}

/// Values of one type.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// 64-bit floats; NaN where there is no value.
    Float(Vec<f64>),
    /// 32-bit floats.
    Single(Vec<f32>),
    /// 32-bit integers.
    Integer(Vec<i32>),
}

impl Values {
    /// How many there are.
    pub fn len(&self) -> usize {
        match self {
            Self::Float(values) => values.len(),
            Self::Single(values) => values.len(),
            Self::Integer(values) => values.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

impl Dataset {
    /// Adds a dimension and returns its index.
    pub fn dimension(&mut self, name: &str, length: usize) -> usize {
        self.dimensions.push((name.to_owned(), length));
        self.dimensions.len() - 1
    }

    /// Adds an attribute.
    pub fn attribute(&mut self, name: &str, value: Attribute) {
        self.attributes.push((name.to_owned(), value));
    }

    /// Adds a text, unless it is empty.
    pub fn text(&mut self, name: &str, text: impl Into<String>) {
        let text = text.into();
        if !text.is_empty() {
            self.attribute(name, Attribute::Text(text));
        }
    }

    /// Adds an array of floats.
    pub fn floats(
        &mut self,
        name: &str,
        dimensions: &[usize],
        values: Vec<f64>,
        unit: &str,
        long_name: &str,
    ) {
        self.variables.push(Variable {
            name: name.to_owned(),
            dimensions: dimensions.to_vec(),
            values: Values::Float(values),
            unit: (!unit.is_empty()).then(|| unit.to_owned()),
            long_name: long_name.to_owned(),
            coordinates: None,
        });
    }

    /// Adds an array of integers.
    pub fn integers(
        &mut self,
        name: &str,
        dimensions: &[usize],
        values: Vec<i32>,
        long_name: &str,
    ) {
        self.variables.push(Variable {
            name: name.to_owned(),
            dimensions: dimensions.to_vec(),
            values: Values::Integer(values),
            unit: None,
            long_name: long_name.to_owned(),
            coordinates: None,
        });
    }

    /// Lengths of the dimensions of a variable.
    pub fn shape(&self, variable: &Variable) -> Vec<usize> {
        variable.dimensions.iter().map(|&index| self.dimensions[index].1).collect()
    }

    /// Names of the dimensions of a variable.
    pub fn dimension_names(&self, variable: &Variable) -> Vec<&str> {
        variable.dimensions.iter().map(|&index| self.dimensions[index].0.as_str()).collect()
    }
}
