-- The results of cabinets in PostgreSQL 15 or later: `psql -f tables.sql`, once. A dashboard needs
-- `GRANT SELECT ON didim_result, didim_parameter, didim_newest, didim_day TO …`.

-- A row of `didim history --out FILE.csv --compact`: a result, or a day of which the cabinet has only the mean left. `results`
-- is then their number.
CREATE TABLE IF NOT EXISTS didim_result (
    identity text PRIMARY KEY,
    cell text,
    robot text,
    result bigint,
    results bigint,
    time timestamptz,
    method text,
    configuration text,
    regrouping text,
    parameters text[] NOT NULL,
    units text[] NOT NULL,
    values double precision[] NOT NULL,
    standard_deviations double precision[] NOT NULL,
    combined_standard_deviations double precision[] NOT NULL,
    scatters double precision[] NOT NULL,
    relative_error double precision,
    applicable boolean NOT NULL,
    monitoring boolean,
    prediction boolean,
    contact_detection boolean,
    physical_values boolean,
    rigid_body boolean,
    payload_kg double precision,
    temperature_c double precision,
    note text,
    motor_temperature_c double precision
);
CREATE INDEX IF NOT EXISTS didim_result_time ON didim_result (cell, time);

-- A row for each parameter of each result, as `didim history --out FILE.csv` has them.
CREATE OR REPLACE VIEW didim_parameter AS
SELECT identity, cell, robot, result, results, time, method, configuration, regrouping, one.*,
    relative_error, applicable, monitoring, prediction, contact_detection, physical_values, rigid_body,
    payload_kg, temperature_c, note, motor_temperature_c
FROM didim_result, unnest(parameters, units, values, standard_deviations, combined_standard_deviations, scatters)
    AS one (parameter, unit, value, standard_deviation, combined_standard_deviation, scatter);

-- The newest result of each cell that is usable for monitoring and has no payload.
CREATE OR REPLACE VIEW didim_newest AS
SELECT DISTINCT ON (cell) * FROM didim_result
WHERE monitoring AND coalesce(payload_kg, 0) = 0 AND time IS NOT NULL AND results IS NULL
ORDER BY cell, time DESC, result DESC;

-- Each parameter by day (UTC): mean and scatter of the results that are usable for monitoring and have no payload, and the
-- mean combined standard deviation. The results of a day share their model errors: the uncertainty of the mean is the larger
-- of the two, and never the scatter divided by the square root of their number. A single result has no scatter.
CREATE OR REPLACE VIEW didim_day AS
SELECT cell, robot, method, regrouping, parameter, unit, date_trunc('day', time, 'UTC') AS day,
    sum(weight) AS results,
    sum(value * weight) / sum(weight) AS mean,
    greatest(stddev_samp(value), max(scatter)) AS scatter,
    sum(combined_standard_deviation * weight) / sum(weight) AS combined_standard_deviation,
    greatest(stddev_samp(value), max(scatter), sum(combined_standard_deviation * weight) / sum(weight)) AS uncertainty,
    sum(motor_temperature_c * weight) / sum(weight) FILTER (WHERE motor_temperature_c IS NOT NULL) AS motor_temperature_c
FROM didim_parameter, coalesce(results, 1) AS weight
WHERE monitoring AND coalesce(payload_kg, 0) = 0 AND time IS NOT NULL
GROUP BY cell, robot, method, regrouping, parameter, unit, day;
