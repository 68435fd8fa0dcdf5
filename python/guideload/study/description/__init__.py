"""What a study is: what varies, what is recorded of each run, and the plan and the metadata that follow."""
