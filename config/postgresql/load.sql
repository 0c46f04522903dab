-- Loads results: `psql --set ON_ERROR_STOP=1 -f load.sql < history.csv`, with the file of
-- `didim history --out history.csv --compact`. A result that the table has is not added again: it never changes. The mean of
-- a day is left out if the table has results of that day.
BEGIN;
CREATE TEMPORARY TABLE new_result (LIKE didim_result) ON COMMIT DROP;
\copy new_result FROM pstdin WITH (FORMAT csv, HEADER match)
INSERT INTO didim_result SELECT * FROM new_result AS new
WHERE new.results IS NULL OR NOT EXISTS (
    SELECT FROM didim_result AS old
    WHERE old.cell = new.cell AND old.results IS NULL
        AND old.time >= date_trunc('day', new.time, 'UTC')
        AND old.time < date_trunc('day', new.time, 'UTC') + interval '1 day')
ON CONFLICT DO NOTHING;
COMMIT;
