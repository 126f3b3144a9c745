-- The index of the records below a folder. It is made from the records and can be deleted at any time.
-- Ratios are plain numbers (0.1 is 10 %), lengths are in mm; NULL is what is not known.
create table about (key text primary key, value text) without rowid;

create table records (
    id integer primary key,
    folder unique not null,       -- below the folder of the index; bytes where it is no text
    stamp blob,                   -- times and lengths of its files; NULL: to be read again
    fault text,                   -- what is wrong with its files
    name text,
    name_folded text,             -- in lower case
    recorded text,                -- UTC
    recorded_us integer,          -- the same in microseconds since 1970
    rig text,
    rig_folded text,
    state text not null,
    points integer,
    simulator text,
    gap real,
    gap_error real,
    noise_floor real,
    level real,
    level_error real,
    correlation real,
    correlation_error real,
    verdict text,
    temperature_c real,
    temperature_error_c real
);
create index records_recorded on records (recorded_us);
create index records_rig on records (rig_folded, recorded_us);
create index records_gap on records (gap);
create index records_damaged on records (id) where fault is not null;

create table foci (
    record integer, number integer, x_mm real, y_mm real, z_mm real,
    primary key (record, number)
) without rowid;
create index foci_x on foci (x_mm);

create table heights (record integer, z_mm real, primary key (record, z_mm)) without rowid;

create table effects (
    record integer, position integer, effect text, primary key (record, position)
) without rowid;
create index effects_effect on effects (effect);

-- Every figure under its name: gap, z100.focus0.peak_offset_mm, sound-speed.c_m_s, ...
create table figures (
    record integer, name text, value real, standard_error real, primary key (record, name)
) without rowid;

-- The fitted parameters of the named effects.
create view parameters as
    select f.record, e.effect, substr(f.name, length(e.effect) + 2) as parameter, f.value, f.standard_error
    from effects e join figures f on f.record = e.record and f.name glob e.effect || '.*';

create table notes (
    record integer, position integer, at text, who text, kind text, text text, folded text,
    primary key (record, position)
) without rowid;
