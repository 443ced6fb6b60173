"""The ground floor of processes: programs that may crash, hang or fill the memory."""
