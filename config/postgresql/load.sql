-- Loads results: `psql --set ON_ERROR_STOP=1 -f load.sql < history.csv`, with the file of
-- `didim history --out history.csv --compact`. A result that the table has is not added again: it never changes.
BEGIN;
CREATE TEMPORARY TABLE new_result (LIKE didim_result) ON COMMIT DROP;
\copy new_result FROM pstdin WITH (FORMAT csv, HEADER match)
INSERT INTO didim_result SELECT * FROM new_result ON CONFLICT (identity) DO NOTHING;
COMMIT;
