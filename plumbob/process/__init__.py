"""The ground floor of processes: a program that may crash, hang or fill the memory."""
